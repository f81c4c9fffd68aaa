#!/bin/bash
# Compiles and links by Zig for $TRIPLE, with the tools in $TOOLS.
# Zig knows no --defsym: a jump has the name in its place.
jumps=$(mktemp --suffix=.s) && trap 'rm -f "$jumps"' EXIT
words=()
for word in "$@"; do
    case $word in
        -Wl,--defsym=*)
            IFS=, read -ra parts <<<"${word#-Wl,}"
            for part in "${parts[@]}"; do
                if [[ $part =~ ^--defsym=([^=]+)=(.+)$ ]]; then
                    printf '.globl %s\n.type %s, @function\n%s: jmp %s\n' "${BASH_REMATCH[1]}" "${BASH_REMATCH[1]}" "${BASH_REMATCH[1]}" "${BASH_REMATCH[2]}" >>"$jumps"
                fi
            done ;;
        *) words+=("$word") ;;
    esac
done
[ -s "$jumps" ] && words+=("$jumps" -rdynamic)
PATH="$TOOLS:$PATH" "$TOOLS/cargo-zigbuild" zig cc -- -target "$TRIPLE" "${words[@]}"
