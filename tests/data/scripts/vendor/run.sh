set -e
mkdir -p out
for node in nodes/*.osl; do
    oslc -q -O2 -Werror -Iheaders -o out/$(basename $node .osl).oso $node
done
oslinfo -p out node_velvet
testshade -g 1 1 --path out node_ramp
echo closure calls: $(grep -c "^.closure.*\$const" out/node_velvet.oso)
cd nodes
oslc -MM -I../headers node_ramp.osl
