set -e
find . -type f -exec touch -d "1 hour ago" {} +
make -s
make -s
echo "-- a header changes"
touch shaders/lib/shape.h
make -s
cat build/rings.d
echo "-- the outer one changes"
touch shaders/lib/limits.h
make -s -j2 | sort
oslinfo build/rings.oso
testshade -g 2 1 --path build --shader rings r --shader tint t --connect r mask t mask
echo "-- an error stops make"
echo 'shader broken() { int k = "text"; }' > shaders/broken.osl
make -s 2> /dev/null && echo "it did not stop" || echo "it stopped"
