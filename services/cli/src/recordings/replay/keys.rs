//! Keys of a terminal, one at a time, without waiting for them.

use std::io::{IsTerminal, Read, Stdin, stdin};
use std::os::fd::AsFd;

use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::termios::{LocalFlags, SetArg, Termios, tcgetattr, tcsetattr};

/// What a key asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wish {
    /// Pause, or go on.
    Pause,
    /// One instant: all its messages.
    Step,
    /// Forward or backward, seconds.
    Seek(f64),
    /// Another rate, by a factor.
    Rate(f64),
    /// The end.
    Quit,
}

const SEEK_S: f64 = 10.0;

/// The keys; the terminal is as it was when this is dropped.
pub struct Keys {
    input: Stdin,
    /// How the terminal was; none where there is no terminal.
    before: Option<Termios>,
}

impl Keys {
    pub fn new() -> Self {
        let input = stdin();
        let before = input.is_terminal().then(|| tcgetattr(input.as_fd()).ok()).flatten();
        if let Some(before) = &before {
            let mut single = before.clone();
            single.local_flags.remove(LocalFlags::ICANON | LocalFlags::ECHO);
            // Where it cannot be set, keys come with the next line.
            let _ = tcsetattr(input.as_fd(), SetArg::TCSANOW, &single);
        }
        Self { input, before }
    }

    /// The next wish, where a key was pressed.
    pub fn next(&mut self) -> Option<Wish> {
        self.before.as_ref()?;
        let mut bytes = [0; 8];
        let mut ready = [PollFd::new(self.input.as_fd(), PollFlags::POLLIN)];
        let is_ready = poll(&mut ready, PollTimeout::ZERO).is_ok_and(|count| count > 0);
        let count = if is_ready { self.input.lock().read(&mut bytes).ok()? } else { 0 };
        wish(&bytes[..count])
    }
}

impl Drop for Keys {
    fn drop(&mut self) {
        if let Some(before) = &self.before {
            let _ = tcsetattr(self.input.as_fd(), SetArg::TCSANOW, before);
        }
    }
}

fn wish(key: &[u8]) -> Option<Wish> {
    match key {
        [b' ', ..] => Some(Wish::Pause),
        [b's' | b'.', ..] => Some(Wish::Step),
        b"\x1b[C" | [b'l', ..] => Some(Wish::Seek(SEEK_S)),
        b"\x1b[D" | [b'h', ..] => Some(Wish::Seek(-SEEK_S)),
        [b'+' | b'=', ..] => Some(Wish::Rate(2.0)),
        [b'-', ..] => Some(Wish::Rate(0.5)),
        [b'q', ..] => Some(Wish::Quit),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_understood() {
        assert_eq!(wish(b" "), Some(Wish::Pause));
        assert_eq!(wish(b"\x1b[D"), Some(Wish::Seek(-SEEK_S)));
        assert_eq!((wish(b"x"), wish(b"")), (None, None));
    }
}
