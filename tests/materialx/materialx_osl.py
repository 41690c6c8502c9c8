"""MaterialX and this program: generated shaders compile and make images, its renderer makes pictures.

materialx_osl.py nodes|headers|docs|pictures FOLDER OSLRUN [FILE.mtlx ...]: the results go to FOLDER. Run it by run.sh.
"""

import concurrent.futures
import os
import pathlib
import random
import re
import shutil
import subprocess
import sys

import MaterialX as mx
import MaterialX.PyMaterialXGenOsl as mx_osl
import MaterialX.PyMaterialXGenShader as mx_shader
import MaterialX.PyMaterialXRender as mx_render
import MaterialX.PyMaterialXRenderOsl as mx_render_osl

from materials import materials

HERE = pathlib.Path(__file__).parent
OURS = HERE.parent.parent / "crates/osl-dialects/dialects/materialx/headers"
THEIRS = pathlib.Path(mx.__file__).parent / "libraries/stdlib/genosl/include"


class Generator:
    """Makes OSL from elements of documents."""

    def __init__(self):
        self.library = mx.createDocument()
        path = mx.getDefaultDataSearchPath()
        mx.loadLibraries(mx.getDefaultDataLibraryFolders(), path, self.library)
        self.generator = mx_osl.OslShaderGenerator.create()
        target = self.generator.getTarget()
        colors = mx_shader.DefaultColorManagementSystem.create(target)
        colors.loadLibrary(self.library)
        self.generator.setColorManagementSystem(colors)
        units = mx_shader.UnitSystem.create(target)
        registry = mx.UnitConverterRegistry.create()
        for name in ("distance", "angle"):
            kind = self.library.getUnitTypeDef(name)
            registry.addUnitConverter(kind, mx.LinearUnitConverter.create(kind))
        units.loadLibrary(self.library)
        units.setUnitConverterRegistry(registry)
        self.generator.setUnitSystem(units)
        self.context = mx_shader.GenContext(self.generator)
        self.context.registerSourceCodeSearchPath(path)
        self.context.getOptions().targetDistanceUnit = "meter"

    def document(self, file=None):
        document = mx.createDocument()
        if file:
            mx.readFromXmlFile(document, str(file))
        document.setDataLibrary(self.library)
        self.generator.registerTypeDefs(document)
        return document

    def shader(self, name, element):
        """The generated shader, or none where MaterialX has no implementation."""
        try:
            return self.generator.generate(name, element, self.context)
        except Exception as why:
            if "matching implementation" in str(why):
                return None
            raise


def text_of(shader):
    return shader.getSourceCode(mx_shader.PIXEL_STAGE)


def run(*words):
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True, check=False)
    return done.returncode, (done.stdout + done.stderr).strip()


def tools(folder, oslrun):
    """Links by which the program acts as the reference's tools."""
    links = folder / "bin"
    links.mkdir(exist_ok=True)
    for tool in ("oslc", "testrender", "testshade"):
        link = links / tool
        link.unlink(missing_ok=True)
        link.symlink_to(oslrun)
    return links


def report(what, failed, count):
    for name, text in failed:
        print(f"{name}: {text}")
    print(f"{what}: {count - len(failed)} of {count}")
    return not failed


def nodes(folder, oslrun):
    """Compiles a shader of every node definition, silently, and makes an image of each but those of strings."""
    generator = Generator()
    document = generator.document()
    links = tools(folder, oslrun)
    files, left_out = [], []
    for definition in generator.library.getNodeDefs():
        name = definition.getName()
        shader = generator.shader(name, document.addNodeInstance(definition, f"n_{name}"))
        if shader is None:
            left_out.append(name)
            continue
        file = folder / f"{name}.osl"
        file.write_text(text_of(shader))
        files.append(file)
    print(f"without an implementation in MaterialX: {len(left_out)}")

    def compiled(file):
        return run(links / "oslc", "-q", f"-I{OURS}", file, "-o", file.with_suffix(".oso"))

    def shaded(file):
        return run(oslrun, "-I", OURS, file, "-g", "4x4", "-o", file.with_suffix(".exr"))

    fine = True
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for what, act in (("compiled", compiled), ("images", shaded)):
            todo = files
            if act is shaded:
                # An image has no place for strings, nor for a file with its color space.
                strings = re.compile(r"output (string|textureresource) +out = ")
                todo = [f for f in files if not strings.search(f.read_text())]
                print(f"string outputs, without an image: {len(files) - len(todo)}")
            failed = [
                (file.stem, text)
                for file, (code, text) in zip(todo, pool.map(act, todo))
                if code != 0 or (act is compiled and text)
            ]
            fine &= report(what, failed, len(todo))
    return fine


def calls():
    """Calls of the functions of the header with random arguments, each as a type and an expression."""
    rng = random.Random(1)
    sizes = {"float": 1, "color": 3, "vector": 3, "point": 3, "color4": 4, "vector2": 2, "vector4": 4}

    def number():
        return f"{rng.uniform(-3, 3):.6f}"

    def value(kind):
        if kind == "int":
            return str(rng.randrange(5))
        if kind == "float":
            return f"({number()} + {number()} * u)"
        numbers = [value("float") for _ in range(sizes.get(kind, 0))]
        if kind == "color4":
            return f"color4(color({', '.join(numbers[:3])}), {numbers[3]})"
        if kind == "matrix":
            return f"matrix({', '.join(value('float') for _ in range(16))})"
        if kind == "matrix33":
            return f"matrix44To33({value('matrix')})"
        return f"{kind}({', '.join(numbers)})"

    def call(result, name, kinds):
        arguments = [value(kind) if kind in sizes or kind.startswith(("int", "matrix")) else kind for kind in kinds]
        return result, f"{name}({', '.join(arguments)})"

    kinds = ["float", "color", "color4", "vector2", "vector4"]
    for kind in [*kinds, "int", "vector", "matrix", "matrix33"]:
        for choice in ("0", "1", "2"):
            yield call(kind, "mx_ternary", [choice, kind, kind])
    # Functions of the types, which come from several headers.
    for kind in ("color4", "vector2", "vector4"):
        for name in ("round", "floor", "abs", "sign", "sin", "exp"):
            yield call(kind, name, [kind])
        for name in ("mod", "fmod", "min", "max", "atan2"):
            yield call(kind, name, [kind, kind])
            yield call(kind, name, [kind, "float"])
        for name in ("mix", "clamp", "smoothstep"):
            yield call(kind, name, [kind, kind, kind])
        yield call(kind, "mix", [kind, kind, "float"])
        yield call(kind, "clamp", [kind, "float", "float"])
    for name in ("mx_add", "mx_subtract"):
        for kind in ("matrix", "matrix33"):
            yield call(kind, name, [kind, kind])
            yield call(kind, name, [kind, "float"])
    for at in range(4):
        for kind in ("color", "vector", "color4", "vector2", "vector4"):
            yield call("float", "mx_extract", [kind, str(min(at, 2) if sizes[kind] == 3 else at)])
        yield call("vector", "mx_extract_matrix33", ["matrix", str(at)])
        yield call("vector4", "mx_extract_matrix44", ["matrix", str(at)])
    for kind in kinds:
        for bound in {kind, "float"}:
            for within in ("0", "1", "2"):
                yield call(kind, "mx_remap", [kind, bound, bound, bound, bound, within])
            yield call(kind, "mx_contrast", [kind, bound, bound])
    for noise in ('"perlin"', '"uperlin"', '"cell"', '"simplex"'):
        for place in (["point"], ["float", "float"]):
            for kind in ("color4", "vector2", "vector4"):
                yield call(kind, "mx_noise", [noise, *place])
            for kind in kinds:
                yield call(kind, "mx_fbm", [*place, "int", "float", "float", noise])
    for place, cells in (("vector2", 4), ("vector", 6)):
        for style, metric in ((s, m) for s in "01" for m in "0123"):
            for result, ending in (("float", "float"), ("vector2", "vector2"), ("vector", "vector3")):
                yield call(result, f"mx_worley_noise_{ending}", [place, "float", style, metric])
            yield call("float", "mx_worley_distance", [place, *["int"] * cells, "float", metric])
        yield call(place, "mx_worley_cell_position", [*["int"] * cells, "float"])


def headers(folder, oslrun):
    """Compares the functions of this project's header with those of MaterialX's, in every bit."""
    parts = {"color4": ["rgb", "a"], "vector2": ["x", "y"], "vector4": ["x", "y", "z", "w"], "matrix33": ["m"]}
    outputs, body = [], []
    for at, (kind, expression) in enumerate(calls()):
        body.append(f"    {kind} r{at} = {expression};")
        for part in parts.get(kind, [""]):
            value = f"r{at}.{part}" if part else f"r{at}"
            name = value.replace(".", "_")
            if kind.startswith("matrix"):
                rows = [[f"{value}[{row}][{column}]" for column in range(3)] for row in range(4)]
                for row, cells in enumerate(rows):
                    outputs.append(f"output vector o{name}_{row} = 0")
                    body.append(f"    o{name}_{row} = vector({', '.join(cells)});")
                    outputs.append(f"output float o{name}_{row}w = 0")
                    body.append(f"    o{name}_{row}w = {value}[{row}][3];")
                continue
            outputs.append(f"output {'color' if part == 'rgb' else 'float' if part else kind} o{name} = 0")
            body.append(f"    o{name} = {value};")
    for at, kind in enumerate(("vector2", "vector")):
        fields = ["x", "y", "z"][: 2 + at]
        body.append(f"    {kind} s{at} = {kind}({', '.join(['1e6'] * len(fields))});")
        body += [f"    mx_sort_distance(2 * cellnoise(u, {k}), s{at});" for k in range(5)]
        for field in fields:
            outputs.append(f"output float os{at}_{field} = 0")
            body.append(f"    os{at}_{field} = s{at}.{field};")
    outputs.append("output float whole = 0")
    outputs.append("output float rest = 0")
    body.append("    int i; rest = mx_floorfrac(7 * u - 3, i); whole = i;")
    file = folder / "header.osl"
    text = ",\n    ".join(outputs)
    file.write_text(f'#include "mx_funcs.h"\nshader header(\n    {text})\n{{\n' + "\n".join(body) + "\n}\n")
    images = {}
    for name, header in (("ours", OURS), ("theirs", THEIRS)):
        images[name] = folder / f"header_{name}.exr"
        code, said = run(oslrun, "-I", header, file, "-g", "16x1", "-o", images[name])
        if code != 0:
            print(f"{name}: {said}")
            return False
    code, said = run(oslrun, "compare", images["ours"], images["theirs"])
    print(f"header: {len(outputs)} outputs compared, {said.splitlines()[-1]}" if code == 0 else said)
    return code == 0


def set_inputs(document, node, inputs):
    """Sets values of a node; a value that is a pair is a node of its own."""
    definition = node.getNodeDef()
    for name, value in inputs.items():
        given = definition.getActiveInput(name)
        if given is None:
            raise ValueError(f"{node.getCategory()} has no input {name}")
        kind = given.getType()
        if isinstance(value, tuple) and isinstance(value[0], str):
            other = document.addNodeInstance(document.getNodeDef(f"ND_{value[0]}"), f"{node.getName()}_{name}")
            set_inputs(document, other, value[1])
            node.addInput(name, kind).setConnectedNode(other)
            continue
        if kind == "color3":
            value = mx.Color3(*value) if isinstance(value, tuple) else mx.Color3(value, value, value)
        node.setInputValue(name, value, kind)


def scenes(generator, files):
    """Names and generated shaders of all materials, and those of the files."""
    document = generator.document()
    definitions = generator.library.getNodeDefs()
    for name, category, inputs in materials():
        found = [d for d in definitions if d.getNodeString() == category or d.getName() == f"ND_{category}"]
        node = document.addNodeInstance(found[-1], f"surface_{name}")
        set_inputs(document, node, inputs)
        yield name, generator.shader(name, node)
    for file in files:
        document = generator.document(file)
        for element in mx_shader.findRenderableElements(document):
            name = mx.createValidName(f"{pathlib.Path(file).stem}_{element.getName()}")
            yield name, generator.shader(name, element)


def pictures(folder, oslrun, files):
    """MaterialX's own renderer drives this program as oslc, testrender and testshade."""
    links = tools(folder, oslrun)
    for file in HERE.glob("*.osl"):
        code, said = run(links / "oslc", "-q", file, "-o", folder / f"{file.stem}.oso")
        if code != 0:
            print(f"{file.name}: {said}")
            return False
    renderer = mx_render_osl.OslRenderer.create(128, 128, mx_render.BaseType.UINT8)
    renderer.setOslCompilerExecutable(str(links / "oslc"))
    renderer.setOslTestRenderExecutable(str(links / "testrender"))
    renderer.setOslTestShadeExecutable(str(links / "testshade"))
    renderer.setOslIncludePath(mx.FileSearchPath(str(OURS)))
    renderer.setOslTestRenderSceneTemplateFile(str(HERE / "scene.xml"))
    renderer.setOslUtilityOSOPath(str(folder))
    renderer.setOslOutputFilePath(str(folder))
    failed, count = [], 0
    for name, shader in scenes(Generator(), files):
        count += 1
        (folder / f"{name}.osl").write_text(text_of(shader))
        output = shader.getStage(mx_shader.PIXEL_STAGE).getOutputBlock(mx_osl.OSL_OUTPUTS)[0]
        # The last one is that of the shader itself.
        kind = re.findall(rf"output (closure color|\w+) {output.getVariable()}\b", text_of(shader))[-1]
        renderer.setOslShaderName(name)
        is_closure = kind in ("closure color", "MATERIAL", "BSDF", "EDF", "VDF")
        renderer.setOslShaderOutput(output.getVariable(), "closure color" if is_closure else kind)
        try:
            renderer.compileOSL(str(folder / f"{name}.osl"))
            for with_testrender in (True, False) if not is_closure else (True,):
                renderer.useTestRender(with_testrender)
                renderer.render()
        except Exception as why:
            errors = list(folder.glob(f"{name}*errors*.txt"))
            failed.append((name, f"{why} {' '.join(file.read_text() for file in errors)}"))
    return report("pictures", failed, count)


def docs(folder, oslrun):
    """Runs the Python code of docs/materialx.md, and makes a preview of the shader that it writes."""
    text = (HERE.parent.parent / "docs/materialx.md").read_text()
    code = re.search(r"```python\n(import.*?)```", text, re.DOTALL).group(1)
    os.chdir(folder)
    shutil.copy(HERE / "material.mtlx", folder)
    exec(code, {})
    code, said = run(oslrun, "-I", OURS, "sky_stone.osl", "--preview", "-g", "64x64", "-o", "stone.png")
    print(said)
    return code == 0 and "shows the closure `out`" in said


def main():
    what, folder, oslrun, *files = sys.argv[1:]
    folder = pathlib.Path(folder).absolute() / what
    folder.mkdir(parents=True, exist_ok=True)
    oslrun = pathlib.Path(oslrun).absolute()
    act = {"nodes": nodes, "headers": headers, "docs": docs}.get(what)
    fine = act(folder, oslrun) if act else pictures(folder, oslrun, [str(pathlib.Path(f).absolute()) for f in files])
    sys.exit(0 if fine else 1)


main()
