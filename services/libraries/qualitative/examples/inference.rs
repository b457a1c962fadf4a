//! Infers new relations from two given ones, by composition and converse.
//!
//! `cargo run -p sketchnav-qualitative --example inference -- rcc8 ntpp ec`

use std::str::FromStr;

use sketchnav_qualitative::allen::Allen;
use sketchnav_qualitative::cardinal::Direction;
use sketchnav_qualitative::rcc::{Rcc5, Rcc8};
use sketchnav_qualitative::{Compose, Converse, Relation};

/// Returns the composition of two relations, and its converse, as text.
fn composed<R: Relation + Compose + Converse + FromStr>(first: &str, next: &str) -> Result<String, R::Err> {
    let (first, next): (R, R) = (first.parse()?, next.parse()?);
    let follows = first.compose(next);
    Ok(format!("a {first} b, b {next} c: a {follows} c, c {} a", follows.converse()))
}

fn main() -> Result<(), sketchnav_qualitative::Error> {
    let words: Vec<_> = std::env::args().skip(1).collect();
    let words: Vec<_> = words.iter().map(String::as_str).collect();
    let answer = match words[..] {
        ["rcc8", first, next] => composed::<Rcc8>(first, next)?,
        ["rcc5", first, next] => composed::<Rcc5>(first, next)?,
        ["allen", first, next] => composed::<Allen>(first, next)?,
        ["cardir", first, next] => composed::<Direction>(first, next)?,
        [] => composed::<Rcc8>("ntpp", "ec")?,
        _ => "expected: rcc8|rcc5|allen|cardir RELATION RELATION".to_owned(),
    };
    println!("{answer}");
    Ok(())
}
