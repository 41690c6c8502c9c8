set -e
for shader in wave read; do oslc -q -Wall $shader.osl; done
mkdir -p out
for shape in sine saw; do
    for n in 1 2; do
        testshade -g 8 4 -od half --param frequency $n.0 --param shape $shape -o Cout out/$shape.$n.exr wave > out/$shape.$n.log
    done
done
testshade -g 8 4 -od uint8 -o Cout out/color.tif -o height out/height.tif wave | grep Output
cat out/saw.2.log
ls out/*.exr
testshade -g 1 1 --center --param file out/sine.1.exr read
testshade -g 1 1 --center --param file out/saw.2.exr read
testshade -g 1 1 --center --param file out/height.tif read
