# Set-up shared by scripts/demo, scripts/test and scripts/check. Sourced, not run.
# shellcheck shell=bash disable=SC2034
# SC2034: the scripts that source this file use the variables.
#
# After `setup_python base|EXTRA` the folder .venv holds a virtual environment with this repository
# installed in it (editable). What is done already is not done again.

ROOT="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
VENV="$ROOT/.venv"
PICTURE_PACKAGES=(libegl1 libgl1-mesa-dri libxrender1)

# One BLAS thread: two threads make the eigen solver slower on matrices of this size.
export OPENBLAS_NUM_THREADS="${OPENBLAS_NUM_THREADS:-1}"
export OMP_NUM_THREADS="${OMP_NUM_THREADS:-1}"
export MKL_NUM_THREADS="${MKL_NUM_THREADS:-1}"
# Draw without a screen.
export VTK_DEFAULT_OPENGL_WINDOW="${VTK_DEFAULT_OPENGL_WINDOW:-vtkEGLRenderWindow}"
export PYVISTA_OFF_SCREEN="${PYVISTA_OFF_SCREEN:-true}"
export PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_INPUT=1

say() { printf '%s\n' "$*" >&2; }

die() {
    say "$*"
    exit 4
}

in_ci() { [[ "${CI:-}" == true || "${CI:-}" == 1 ]]; }

# as_root COMMAND...: run it as root; fails without a word when that needs a password.
as_root() {
    if [[ "$(id -u)" -eq 0 ]]; then
        "$@"
    elif command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
        sudo -n "$@"
    else
        return 1
    fi
}

installed() { # is the Debian package there?
    [[ "$(dpkg-query -W -f '${db:Status-Abbrev}' "$1" 2>/dev/null)" == ii* ]]
}

# system_packages WHAT_FOR PACKAGE...: install the missing ones; when that is not possible, say the
# exact line to type and return 1.
system_packages() {
    local what="$1" package missing=()
    shift
    if ! command -v apt-get >/dev/null || ! command -v dpkg-query >/dev/null; then
        say "This is not Debian or Ubuntu: for $what, install what they call $*."
        return 1
    fi
    for package in "$@"; do
        installed "$package" || missing+=("$package")
    done
    [[ ${#missing[@]} -eq 0 ]] && return 0
    say "Installing for $what: ${missing[*]}"
    if as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq update </dev/null >&2 &&
        as_root env DEBIAN_FRONTEND=noninteractive \
            apt-get -qq install -y --no-install-recommends "${missing[@]}" </dev/null >&2; then
        return 0
    fi
    say "Could not install them. Please type:"
    say "    sudo apt-get update && sudo apt-get install -y ${missing[*]}"
    return 1
}

suitable_python() { # is it Python 3.11 to 3.14?
    "$1" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 14))' >/dev/null 2>&1
}

find_python() { # print the first suitable Python
    local candidate
    for candidate in ${TECHNIC_PYTHON:+"$TECHNIC_PYTHON"} python3 python3.11 python3.12 python3.13 \
        python3.14; do
        if suitable_python "$candidate"; then
            command -v "$candidate"
            return 0
        fi
    done
    return 1
}

make_venv() {
    local python
    if ! python="$(find_python)"; then
        system_packages "Python" python3 python3-venv || die "Python 3.11 to 3.14 is needed."
        python="$(find_python)" || die "Python 3.11 to 3.14 is needed; set TECHNIC_PYTHON to one."
    fi
    if ! "$python" -c 'import ensurepip, venv' >/dev/null 2>&1; then
        system_packages "Python's virtual environments" \
            "python$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')-venv" ||
            die "$python cannot make virtual environments."
    fi
    say "Making the virtual environment $VENV with $("$python" --version)"
    "$python" -m venv --clear "$VENV"
}

# setup_python base|EXTRA: virtual environment with the package, and with the extra if one is named.
setup_python() {
    local extra="$1" stamp key target
    cd "$ROOT" || die "The folder $ROOT has gone."
    if ! suitable_python "$VENV/bin/python" || ! "$VENV/bin/python" -m pip --version >/dev/null 2>&1; then
        make_venv
    fi
    stamp="$VENV/.technic-installed-$extra"
    # A new pyproject.toml, another place or another Python: install again.
    key="$(sha256sum pyproject.toml | cut -d' ' -f1) $ROOT $("$VENV/bin/python" --version)"
    if [[ -f "$stamp" && "$(<"$stamp")" == "$key" ]]; then
        return 0
    fi
    target="$ROOT"
    [[ "$extra" == base ]] || target="${ROOT}[${extra}]"
    say "Installing the package and what it needs (once; a few hundred megabytes)"
    if ! "$VENV/bin/python" -m pip install -q --retries 5 -e "$target" >&2; then
        die "The installation failed; the lines above say why."
    fi
    printf '%s' "$key" >"$stamp"
    printf '%s' "$key" >"$VENV/.technic-installed-base"
}
