"""Print a script that makes a shell complete commands, options, files, robots and topics.

For bash: `rbxcompose completion bash > ~/.local/share/bash-completion/completions/rbxcompose`. For zsh: the same as
`_rbxcompose` in a folder of `$fpath`. For fish: `~/.config/fish/completions/rbxcompose.fish`.
"""

from __future__ import annotations

import argparse

from rbxcompose.cli.output.console import tell

# A script queries the candidates each time, so that it need not change with each version.

_BASH = r"""_rbxcompose() {
    local one
    COMPREPLY=()
    while IFS= read -r one; do
        COMPREPLY+=("$(printf %q "$one")")
    done < <(rbxcompose __complete bash "${COMP_LINE:0:COMP_POINT}" 2>/dev/null)
    if [[ ${#COMPREPLY[@]} -eq 1 && ${COMPREPLY[0]} == */ ]]; then
        compopt -o nospace 2>/dev/null
    fi
}
complete -F _rbxcompose rbxcompose"""

_ZSH = r"""#compdef rbxcompose
_rbxcompose() {
    local -a found
    found=("${(@f)$(rbxcompose __complete zsh "${(@)words[1,CURRENT]}" 2>/dev/null)}")
    compadd -S '' -- ${(M)found:#*/}
    compadd -- ${found:#*/}
}
if [[ $funcstack[1] == _rbxcompose ]]; then
    _rbxcompose
else
    compdef _rbxcompose rbxcompose
fi"""

_FISH = r"""function __rbxcompose_complete
    set -l current (commandline -ct)
    rbxcompose __complete fish (commandline -opc) "$current" 2>/dev/null
end
complete -c rbxcompose -f -a '(__rbxcompose_complete)'"""

SCRIPTS = {"bash": _BASH, "zsh": _ZSH, "fish": _FISH}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("shell", choices=list(SCRIPTS), help="the shell that will read it")


def run(arguments: argparse.Namespace) -> int:
    """Print the script."""
    tell(SCRIPTS[arguments.shell])
    return 0
