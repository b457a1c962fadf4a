//! Files that are first written without a name, so that they are complete once they have their final name.

use std::fs::Permissions;
use std::io::{self, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use tempfile::{Builder, NamedTempFile};

/// The mode of any other new file, before the user's mask.
const MODE: u32 = 0o666;

/// Creates an unnamed file in `folder` with the given bytes.
///
/// # Errors
/// Those of the system.
pub fn of(folder: &Path, bytes: &[u8]) -> io::Result<NamedTempFile> {
    let mut draft = Builder::new().permissions(Permissions::from_mode(MODE)).tempfile_in(folder)?;
    draft.write_all(bytes)?;
    Ok(draft)
}
