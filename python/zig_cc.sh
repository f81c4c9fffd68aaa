#!/bin/bash
# Compiles and links by Zig for $TRIPLE, with the tools in $TOOLS.
#
# Zig knows neither --defsym nor --export-dynamic-symbol. A jump has the name of each --defsym in its place. These names are exported
# since a library asks for them, which the program does not need when it runs.
set -e
compile() { PATH="$TOOLS:$PATH" "$TOOLS/cargo-zigbuild" zig cc -- -target "$TRIPLE" "$@"; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
words=()
for word in "$@"; do
    if [[ $word == -Wl,--defsym=* ]]; then
        IFS=, read -ra parts <<<"${word#-Wl,}"
        for part in "${parts[@]}"; do
            if [[ $part =~ ^--defsym=([^=]+)=(.+)$ ]]; then
                name=${BASH_REMATCH[1]}
                printf '.globl %s\n.type %s, @function\n%s: jmp %s\n' "$name" "$name" "$name" "${BASH_REMATCH[2]}" >>"$folder/jumps.s"
                printf '.data\n.quad %s\n' "$name" >>"$folder/asks.s"
            fi
        done
    else
        words+=("$word")
    fi
done
if [ -e "$folder/jumps.s" ]; then
    compile -shared -nostdlib "$folder/asks.s" -o "$folder/libasks.so"
    words+=("$folder/jumps.s" -Wl,--as-needed "$folder/libasks.so")
fi
compile "${words[@]}"
