//! `groundglass schema`: the JSON schema of the scene file on standard output.

use super::report;
use groundglass::error::Result;

pub(super) fn run() -> Result<()> {
    report::print(&groundglass::scene::schema())
}
