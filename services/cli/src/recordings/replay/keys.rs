//! Reads the keys of a terminal one at a time, without waiting for them.

use std::collections::VecDeque;
use std::io::{IsTerminal, Read, Stdin, stdin};
use std::os::fd::AsFd;

use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::termios::{LocalFlags, SetArg, Termios, tcgetattr, tcsetattr};
use nix::unistd::{getpgrp, tcgetpgrp};

/// The action that a key asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wish {
    /// Pause or continue.
    Pause,
    /// Step by one instant, with all its messages.
    Step,
    /// Seek forward or, if negative, backward by this many seconds.
    Seek(f64),
    /// Multiply the rate by this factor.
    Rate(f64),
    /// Stop playing.
    Quit,
}

const SEEK_S: f64 = 10.0;

/// Reads the keys. Dropping this restores the terminal's settings.
pub struct Keys {
    input: Stdin,
    /// The terminal's previous settings, or `None` if there is no terminal or this process is in the background.
    before: Option<Termios>,
    /// Bytes that were read but not interpreted yet, since keys that are held down arrive several at a time.
    read: VecDeque<u8>,
}

impl Keys {
    pub fn new() -> Self {
        let input = stdin();
        let before = is_ours(&input).then(|| tcgetattr(input.as_fd()).ok()).flatten();
        if let Some(before) = &before {
            let mut single = before.clone();
            single.local_flags.remove(LocalFlags::ICANON | LocalFlags::ECHO);
            // If this fails, keys only arrive at the end of a line.
            let _ = tcsetattr(input.as_fd(), SetArg::TCSANOW, &single);
        }
        Self { input, before, read: VecDeque::new() }
    }

    /// Returns the next action, if a key was pressed.
    pub fn next(&mut self) -> Option<Wish> {
        self.before.as_ref()?;
        let mut bytes = [0; 64];
        let mut ready = [PollFd::new(self.input.as_fd(), PollFlags::POLLIN)];
        let is_ready = poll(&mut ready, PollTimeout::ZERO).is_ok_and(|count| count > 0);
        let count =
            if is_ready && is_ours(&self.input) { self.input.lock().read(&mut bytes).ok()? } else { 0 };
        self.read.extend(&bytes[..count]);
        wish(&mut self.read)
    }
}

/// Returns true if this process is in the terminal's foreground. A background process that reads from the terminal or
/// changes its settings is stopped.
fn is_ours(input: &Stdin) -> bool {
    input.is_terminal() && tcgetpgrp(input).is_ok_and(|group| group == getpgrp())
}

impl Drop for Keys {
    fn drop(&mut self) {
        if let Some(before) = self.before.as_ref().filter(|_| is_ours(&self.input)) {
            let _ = tcsetattr(self.input.as_fd(), SetArg::TCSANOW, before);
        }
    }
}

/// Consumes bytes up to and including the first key that has a meaning.
fn wish(read: &mut VecDeque<u8>) -> Option<Wish> {
    while let Some(key) = read.pop_front() {
        // An arrow key sends an escape, a bracket (or an O) and a letter.
        let is_arrow = key == 0x1b && matches!(read.front(), Some(b'[' | b'O'));
        let key = if is_arrow { read.drain(..2.min(read.len())).next_back() } else { Some(key) };
        let wish = match (is_arrow, key) {
            (false, Some(b' ')) => Wish::Pause,
            (false, Some(b's' | b'.')) => Wish::Step,
            (true, Some(b'C')) | (false, Some(b'l')) => Wish::Seek(SEEK_S),
            (true, Some(b'D')) | (false, Some(b'h')) => Wish::Seek(-SEEK_S),
            (false, Some(b'+' | b'=')) => Wish::Rate(2.0),
            (false, Some(b'-')) => Wish::Rate(0.5),
            (false, Some(b'q')) => Wish::Quit,
            _ => continue,
        };
        return Some(wish);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_understood() {
        let all = |bytes: &[u8]| {
            let mut read: VecDeque<u8> = bytes.iter().copied().collect();
            std::iter::from_fn(move || wish(&mut read)).collect::<Vec<_>>()
        };
        assert_eq!(all(b" "), [Wish::Pause]);
        assert_eq!(all(b"x\x1b[D"), [Wish::Seek(-SEEK_S)]);
        // Arrow keys that are held down arrive several at a time, and once none of them counted.
        assert_eq!(
            all(b"\x1b[C\x1b[C\x1bOCs"),
            [Wish::Seek(10.0), Wish::Seek(10.0), Wish::Seek(10.0), Wish::Step]
        );
        assert_eq!((all(b"\x1b"), all(b"\x1b["), all(b"\x1b[A")), (vec![], vec![], vec![]));
    }
}
