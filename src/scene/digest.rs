//! A digest of asset bytes in a fixed order: bytes in, SHA-256 out; names and paths do not enter.

use sha2::{Digest as _, Sha256};

/// SHA-256 of one file or of a list of such digests.
pub(crate) type Digest = [u8; 32];

/// What stands for a file that was asked for and could not be read.
pub(crate) const ABSENT: Digest = [0; 32];

/// The digest of one file's bytes.
pub(crate) fn of_bytes(bytes: &[u8]) -> Digest {
    Sha256::digest(bytes).into()
}

/// The digest of a list of digests, order and number included.
pub(crate) fn of_list(list: &[Digest]) -> Digest {
    let mut all = Sha256::new();
    all.update((list.len() as u64).to_le_bytes());
    for one in list {
        all.update(one);
    }
    all.finalize().into()
}
