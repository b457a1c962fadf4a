//! Helpers shared by several tests.

#![allow(dead_code, reason = "each test uses a part")]

pub mod carmen;
