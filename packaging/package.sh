#!/usr/bin/env bash
# Builds the Debian package in target/debian: the program, its service, manual pages, completions, the header for C++, pages.
#
#   packaging/package.sh            builds the program first, with the live view
#   packaging/package.sh PROGRAM    uses a program built with the feature `manuals`
#
# Requires cargo-deb 3: `cargo install cargo-deb`.
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

# The files to which the package's metadata in Cargo.toml refers.
made="$release/packaging"
rm -rf "$made"
mkdir -p "$made"
"$release/sketchnav" man "$made/man" >&2
for shell in bash zsh fish; do
    "$release/sketchnav" completions $shell >"$made/sketchnav.$shell"
done

# The release profile keeps line numbers for backtraces; the package omits them.
cargo deb --no-build --strip
