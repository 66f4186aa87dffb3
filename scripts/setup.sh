#!/bin/sh
# Makes .venv with texvol in it, and sees to it that OpenGL answers. Does nothing, quickly, where that is done.
# Usage: sh scripts/setup.sh [EXTRA [BESIDE]]     EXTRA: as in pyproject.toml
# BESIDE: osmesa is wanted beside EGL; or paraview, which scripts/benchmark_paraview.py is measured beside; or
# side-by-side, the programs of scripts/compare_first_pictures.py, in an environment of their own; or others, those of
# scripts/benchmark_beside.py, likewise
set -eu
extra=${1:-}
wanted_too=${2:-}
CDPATH='' cd -- "$(dirname -- "$0")/.."
python=.venv/bin/python

say() { printf 'texvol: %s\n' "$*"; }
fail() { printf 'texvol: error: %s\n' "$*" >&2; exit 1; }
new_enough() { "$1" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; }

as_root() {
    if [ "$(id -u)" = 0 ]; then "$@"
    elif command -v sudo >/dev/null; then sudo "$@"
    else fail "please run as root: $*"
    fi
}

manager=
for each in apt-get dnf apk pacman zypper; do
    if command -v "$each" >/dev/null; then manager=$each; break; fi
done

# Install the system's packages; what the package manager says is shown only if it fails.
install_packages() {
    say "installing $* with $manager"
    case $manager in
        apt-get) as_root apt-get -qq update && as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq install -y "$@" ;;
        dnf) as_root dnf -q install -y "$@" ;;
        apk) as_root apk add -q "$@" ;;
        pacman) as_root pacman -Sy --noconfirm --needed --quiet "$@" ;;
        zypper) as_root zypper -q --non-interactive install "$@" ;;
    esac >.venv.log 2>&1 || { cat .venv.log >&2; rm -f .venv.log; return 1; }
    rm -f .venv.log
}

# 1. A Python environment.

make_venv() { rm -rf .venv && "$1" -m venv .venv >/dev/null 2>&1 && .venv/bin/python -m pip --version >/dev/null 2>&1; }

if ! new_enough "$python"; then
    found=
    for each in python3 python3.13 python3.12 python3.11; do
        if new_enough "$each"; then found=$each; break; fi
    done
    [ -n "$found" ] || fail "no Python 3.11 or later found (looked for python3, python3.13, python3.12, python3.11)"
    say "making .venv with $("$found" --version)"
    if ! make_venv "$found"; then
        package=python$("$found" -c 'import sys; print("%d.%d" % sys.version_info[:2])')-venv
        if [ "$manager" != apt-get ] || ! install_packages "$package" || ! make_venv "$found"; then
            rm -rf .venv
            fail "$found cannot make an environment: install its venv module (Debian, Ubuntu: python3-venv)"
        fi
    fi
fi

# 2. Beside it, and at the same time, what tests of pages, of the window, of OpenVDB's reader and of completion need.
# Debian's and Ubuntu's only, each asked for once.

kinds="chromium xvfb manager openvdb shells"
may_install() { [ "$manager" = apt-get ] && { [ "$(id -u)" = 0 ] || sudo -n true 2>/dev/null; }; }
# GLFW opens libGL by name, and nothing else here needs it.
find_gl="import ctypes.util; print(ctypes.util.find_library('GL') or '')"

has() {
    case $1 in
        chromium) command -v chromium || command -v chromium-browser || command -v google-chrome ;;
        xvfb) command -v Xvfb && command -v xdotool && command -v xclip && [ -n "$("$python" -c "$find_gl")" ] ;;
        manager) command -v openbox && command -v xprop && command -v xrdb ;;
        openvdb) /usr/bin/python3 -c 'import pyopenvdb' 2>&1 ;;
        shells) command -v zsh && command -v fish ;;
    esac >/dev/null
}
packages() {
    case $1 in
        chromium) echo chromium ;;
        xvfb) echo xvfb xdotool xclip libgl1 libgl1-mesa-dri ;;
        manager) echo openbox x11-utils x11-xserver-utils ;;
        openvdb) echo python3-openvdb ;;
        shells) echo zsh fish ;;
    esac
}
named() {
    case $1 in
        chromium) echo Chromium ;;
        xvfb) echo "Xvfb with xdotool and xclip" ;;
        manager) echo "window manager (openbox) with xprop and xrdb" ;;
        openvdb) echo "module of OpenVDB for the system's Python" ;;
        shells) echo "zsh with fish" ;;
    esac
}

installing=
if [ "$extra" = test ] && may_install; then
    wanted=
    for each in $kinds; do
        if ! has "$each" && [ ! -e ".venv/no-$each" ]; then wanted="$wanted $(packages "$each")"; fi
    done
    if [ -n "$wanted" ]; then # shellcheck disable=SC2086  (one word for each package)
        (install_packages $wanted || for each in $wanted; do install_packages "$each" || true; done) & installing=$!
    fi
fi

# 3. texvol and its libraries, again whenever pyproject.toml, Python or the place has changed.

pip_install() { "$python" -m pip install --quiet --disable-pip-version-check "$@"; }
# uv does what pip does in a fraction of the time, and obeys another configuration: where it fails pip is asked.
install_python() {
    index=${PIP_INDEX_URL:-$("$python" -m pip config get global.index-url 2>/dev/null || true)}
    if [ -n "$index" ]; then export UV_DEFAULT_INDEX="$index"; fi
    pip_install uv 2>/dev/null &&
        UV_NATIVE_TLS=1 .venv/bin/uv pip install --quiet --python "$python" --editable "$1" 2>/dev/null ||
        pip_install --editable "$1"
}

# Any extra has the base in it.
stamp="$("$python" --version) $(cksum <pyproject.toml) $PWD"
if [ -n "$extra" ]; then set -- ".venv/installed-$extra"; else set -- .venv/installed-*; fi
complete=false
for each in "$@"; do
    if [ "$(cat "$each" 2>/dev/null)" = "$stamp" ]; then complete=true; fi
done
if ! $complete; then
    say "installing texvol${extra:+[$extra]} into .venv"
    install_python ".${extra:+[$extra]}" ||
        fail "pip could not install texvol${extra:+[$extra]} (see above)"
    printf '%s' "$stamp" >".venv/installed-${extra:-base}"
fi
[ -z "$installing" ] || wait "$installing" || true # one package manager at a time; what is missing is named below

# 4. OpenGL.

try_backend="import sys; from texvol.opengl.contexts import open_context; open_context(sys.argv[1]).release()"
opens() { "$python" -c "$try_backend" "$1" 2>/dev/null; }

mesa() {
    case $manager,$1 in
        apt-get,egl) echo libegl1 libgl1-mesa-dri ;;
        apt-get,osmesa) echo libosmesa6 ;;
        dnf,egl) echo mesa-libEGL mesa-dri-drivers ;;
        dnf,osmesa) echo mesa-libOSMesa ;;
        apk,egl) echo mesa-egl mesa-dri-gallium ;;
        apk,osmesa) echo mesa-osmesa ;;
        pacman,*) echo mesa ;;
        zypper,egl) echo Mesa-libEGL1 Mesa-dri ;;
        zypper,osmesa) echo libOSMesa8 ;;
    esac
}

# Usage: ensure BACKEND PACKAGES_OF
ensure() { # shellcheck disable=SC2046  (one word for each package)
    opens "$1" || { [ -n "$manager" ] && install_packages $(mesa "$2") && opens "$1"; }
}

if ! ensure auto egl && ! ensure auto osmesa; then
    "$python" -c "$try_backend" auto 2>&1 | tail -n 1 >&2
    fail "no OpenGL driver answers, and installing Mesa's did not help"
fi
if [ "$wanted_too" = osmesa ]; then
    opens egl || say "EGL does not answer here; what needs it is skipped"
    # A system that has no OSMesa is asked once.
    if ! opens osmesa && { [ -e .venv/no-osmesa ] || ! ensure osmesa osmesa; }; then
        : >.venv/no-osmesa
        say "this system has no OSMesa (Mesa dropped it in 25.1); what needs it is skipped"
    fi
fi

# 5. What tests of pages, of the window, of OpenVDB's reader and of completion need beside: without it they are skipped.

if [ "$extra" = test ]; then
    for each in $kinds; do
        if has "$each" || [ -e ".venv/no-$each" ]; then continue; fi
        : >".venv/no-$each"
        say "no $(named "$each") here, and none could be installed; what needs it is skipped"
    done
fi

# 6. ParaView's pvbatch with MPI, and a display for it; asked for by name, so that its absence is an error.

has_paraview() { command -v pvbatch && command -v mpiexec && command -v Xvfb; }
if [ "$wanted_too" = paraview ] && ! has_paraview >/dev/null; then
    [ "$manager" = apt-get ] || fail "ParaView is installed on Debian and Ubuntu only; install pvbatch, mpiexec and Xvfb"
    install_packages python3-paraview paraview openmpi-bin xvfb libgl1 libgl1-mesa-dri && has_paraview >/dev/null ||
        fail "pvbatch, mpiexec and Xvfb could not be installed (see above)"
fi

# 7. PyVista, F3D and VTK in .venv-side, so that their versions are not ours.

beside_python=.venv-side/bin/python
compares() { "$beside_python" -c 'import f3d, pyvista' 2>/dev/null; }
if [ "$wanted_too" = side-by-side ] && ! compares; then
    say "installing PyVista, VTK and F3D into .venv-side"
    "$python" -m venv .venv-side && "$beside_python" -m pip install --quiet --disable-pip-version-check \
        'pyvista>=0.49,<1' 'f3d>=4,<5' && compares || fail "PyVista and F3D could not be installed (see above)"
fi

# 8. vispy (with PyOpenGL, for volumes), PyVista, yt, Mitsuba 3 and pynari in .venv-others; Mitsuba compiles by LLVM 16 or later, of the system.

others_python=.venv-others/bin/python
draws() { "$others_python" -c 'import mitsuba, OpenGL, pynari, pyvista, vispy, yt' 2>/dev/null; }
has_llvm() { [ -n "$(find /usr/lib -name 'libLLVM.so.19*' -o -name 'libLLVM-16*')" ]; }
if [ "$wanted_too" = others ]; then
    if ! draws; then
        say "installing vispy, PyVista, yt, Mitsuba and pynari into .venv-others"
        "$python" -m venv .venv-others && "$others_python" -m pip install --quiet --disable-pip-version-check \
            'vispy>=0.17,<1' 'PyOpenGL>=3.1.7,<4' 'pyvista>=0.49,<1' 'yt>=4.4,<5' 'mitsuba>=3.9,<4' 'pynari>=1.2.6,<2' &&
            draws || fail "the other programs could not be installed (see above)"
    fi
    [ "$manager" != apt-get ] || has_llvm ||
        install_packages libllvm19 || install_packages libllvm16 || say "no LLVM 16 or later here; Mitsuba is left out"
fi
