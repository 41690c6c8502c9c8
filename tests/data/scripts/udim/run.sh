set -e
oslc -q tile.osl
oslc -q lookup.osl
mkdir -p maps
for tile in 1001 1002 1011 1012; do
    testshade -g 8 8 --center -od float --param level $tile.0 -o Cout maps/skin.$tile.exr tile > log.txt
done
ls maps
testshade -g 1 1 --param file "maps/skin.<UDIM>.exr" lookup
