#!/usr/bin/env bash
# Makes the Debian package in target/debian: the program, its service, manual pages, completions, the header for C++, pages.
#
#   packaging/package.sh            builds the program first, with the live view
#   packaging/package.sh PROGRAM    takes one that is built, with the feature `manuals`
#
# Wants cargo-deb 3: `cargo install cargo-deb`.
set -euo pipefail
cd "$(dirname "$0")/.."
target="${CARGO_TARGET_DIR:-target}"
release="$target/release"

if [ $# -gt 0 ]; then
    mkdir -p "$release"
    [ "$1" -ef "$release/sketchnav" ] || cp "$1" "$release/sketchnav"
else
    cargo build --release --locked --features foxglove,manuals
fi

# What the package's metadata in Cargo.toml takes from there.
made="$release/packaging"
rm -rf "$made"
mkdir -p "$made"
"$release/sketchnav" man "$made/man" >&2
for shell in bash zsh fish; do
    "$release/sketchnav" completions $shell >"$made/sketchnav.$shell"
done

# The release profile keeps line numbers for backtraces; a package has none.
cargo deb --no-build --strip
