//! What several tests share.

#![allow(dead_code, reason = "each test binary uses its part")]

pub mod extremes;
pub mod oracle;
pub mod scenes;
