//! Where the token of a pad comes from, and where a later pad finds it.
//!
//! Only its user can read the environment of a process, whereas everyone can read its command line. The
//! system's folder is private to its user as well. The pad stores the token there, so that a resumed mission
//! (`run --resume`) keeps the link that open pages are using.

use std::env::{VarError, var};
use std::fs::{self, File};
use std::io::{ErrorKind, Write};
use std::os::unix::fs::OpenOptionsExt;

use anyhow::Context;
use sketchnav_runtime::System;

use crate::PadError;
use crate::guard::Token;

/// The environment variable that contains the token.
pub const TOKEN_VARIABLE: &str = "SKETCHNAV_PAD_TOKEN";
/// The file in the system's folder that contains it.
const FILE: &str = "pad-token";

/// Returns the token in the environment, or `None` if there is none.
///
/// # Errors
/// [`PadError::Token`] if it is not a valid token.
pub fn of_environment() -> Result<Option<Token>, PadError> {
    match var(TOKEN_VARIABLE) {
        Ok(text) => text.parse().map(Some).map_err(|expected| PadError::Token(expected, "others")),
        Err(VarError::NotPresent) => Ok(None),
        Err(VarError::NotUnicode(_)) => Err(PadError::Token("expected letters and digits".into(), "others")),
    }
}

/// Returns the token that a pad's process must be given.
///
/// # Errors
/// [`PadError::Token`] if it was not given one.
pub fn given() -> Result<Token, PadError> {
    of_environment()?.ok_or_else(|| PadError::Token("expected the token of the page".into(), "none"))
}

/// Stores the token for those who resume the system.
pub(crate) fn keep(system: &System, token: &Token) -> anyhow::Result<()> {
    let (path, new) = (system.folder().join(FILE), system.folder().join("pad-token.new"));
    let keep = || {
        match fs::remove_file(&new) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let mut file = File::options().write(true).create_new(true).mode(0o600).open(&new)?;
        file.write_all(token.text().as_bytes())?;
        fs::rename(&new, &path)
    };
    keep().with_context(|| path.display().to_string())
}

/// Returns the token of the system's previous pad, or `None` if it had none.
pub fn kept(system: &System) -> Option<Token> {
    fs::read_to_string(system.folder().join(FILE)).ok()?.parse().ok()
}
