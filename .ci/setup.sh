#!/usr/bin/env bash
# Prepares a checkout: .venv with the locked packages and the project itself, and a library
# that renders without a display. Run through `make setup`; a second run finds its stamps
# and does nothing.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

VENV=.venv
PYTHON=$VENV/bin/python
EGL_PACKAGES="libegl1 libgl1 libgl1-mesa-dri" # with Mesa's software driver
OSMESA_PACKAGES="libosmesa6" # dropped from Debian 13 on

say() { echo "setup: $*"; }
die() { echo "setup: $*" >&2; exit 1; }

# ---- apt, where it is permitted -------------------------------------------------------------

as_root() {
    if [ "$(id -u)" = 0 ]; then "$@"; else sudo -n "$@"; fi
}

apt_permitted() {
    command -v apt-get >/dev/null || return 1
    [ "$(id -u)" = 0 ] || sudo -n true 2>/dev/null
}

apt_install() { # package...; quiet unless it fails
    local log environment=(env DEBIAN_FRONTEND=noninteractive
        PATH="/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin")
    say "installing with apt: $*"
    # A list that cannot be refreshed need not matter: the install says whether it does.
    as_root "${environment[@]}" apt-get -qq update >/dev/null 2>&1 || true
    log=$(as_root "${environment[@]}" apt-get -qq install -y --no-install-recommends "$@" 2>&1) ||
        { echo "$log" >&2; return 1; }
}

# ---- Python ---------------------------------------------------------------------------------

find_python() { # prints the first interpreter that is new enough
    local candidate
    for candidate in python3 python3.11 python3.12 python3.13 python3.14; do
        if command -v "$candidate" >/dev/null &&
            "$candidate" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
            command -v "$candidate"
            return
        fi
    done
    return 1
}

require_ensurepip() { # interpreter: Debian splits venv's ensurepip off into a package
    local package
    "$1" -c 'import ensurepip, venv' 2>/dev/null && return
    package=$("$1" -c 'import sys; print("python%d.%d-venv" % sys.version_info[:2])')
    if apt_permitted; then apt_install "$package" || true; fi
    "$1" -c 'import ensurepip, venv' 2>/dev/null ||
        die "$1 cannot make virtual environments; type: sudo apt-get install $package"
}

usable_venv() { # present, whole, and made here (scripts hold absolute paths)
    [ "$(cat $VENV/.made-in 2>/dev/null)" = "$PWD" ] && $PYTHON -m pip --version >/dev/null 2>&1
}

install_packages() {
    local python
    if ! usable_venv; then
        python=$(find_python) || die "Python 3.11 or newer is needed, and python3 is" \
            "$(python3 --version 2>/dev/null || echo missing);" \
            "type: sudo apt-get install python3.11 python3.11-venv (or any newer one)"
        require_ensurepip "$python"
        say "making $VENV with $("$python" --version)"
        "$python" -m venv --clear $VENV
        echo "$PWD" >$VENV/.made-in
    fi
    say "installing the locked packages (some minutes the first time)"
    local pip=($PYTHON -m pip --disable-pip-version-check --quiet install)
    "${pip[@]}" --require-hashes -r requirements.lock
    "${pip[@]}" --no-deps --no-build-isolation --editable .
}

# ---- rendering without a display ------------------------------------------------------------

renders_with() { # egl | osmesa: a picture of a lit sphere must not be black
    MUJOCO_GL=$1 $PYTHON - >/dev/null 2>&1 <<'PROGRAM'
import mujoco

model = mujoco.MjModel.from_xml_string(
    "<mujoco><worldbody><light pos='0 0 2'/><geom size='.1'/></worldbody></mujoco>"
)
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
renderer = mujoco.Renderer(model, 64, 64)
renderer.update_scene(data)
assert renderer.render().any()
PROGRAM
}

find_backend() { # prints the back end to use; installs what is missing where it may
    if renders_with egl; then echo egl; return; fi
    if apt_permitted; then
        apt_install $EGL_PACKAGES >&2 || true
        if renders_with egl; then echo egl; return; fi
    fi
    if renders_with osmesa; then echo osmesa; return; fi
    if apt_permitted && apt-cache show $OSMESA_PACKAGES >/dev/null 2>&1; then
        apt_install $OSMESA_PACKAGES >&2 || true
        if renders_with osmesa; then echo osmesa; return; fi
    fi
    return 1
}

prepare_rendering() {
    local backend
    backend=$(find_backend) || die "no OpenGL library renders without a display;" \
        "type: sudo apt-get install $EGL_PACKAGES"
    echo "$backend" >$VENV/.backend
    say "rendering with $backend"
}

# ---- a browser for the tests of the pages ---------------------------------------------------

prepare_browser() { # what it cannot install, the tests skip and say so
    command -v chromium chromium-browser google-chrome >/dev/null && return
    if apt_permitted; then apt_install chromium || true; fi
    command -v chromium chromium-browser google-chrome >/dev/null ||
        say "no browser: the tests of the pages will be skipped; type: sudo apt-get install chromium"
}

# ---- what is done already -------------------------------------------------------------------

wanted=$(cat pyproject.toml requirements.lock .ci/setup.sh | sha256sum)
if [ "$(cat $VENV/.packages 2>/dev/null)" != "$wanted" ] || ! [ -x $VENV/bin/aoicell ] ||
    ! usable_venv; then
    rm -f $VENV/.packages
    install_packages
    echo "$wanted" >$VENV/.packages
fi
[ -s $VENV/.backend ] || prepare_rendering
if [ "${1:-}" = --browser ]; then prepare_browser; fi
