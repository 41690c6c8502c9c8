//! Command lines: a line of the input is a word of the command line.

use super::data::command;
use super::message;
use std::ffi::OsString;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicU64, Ordering};
use tempfile::TempDir;

/// Options of all commands, and values of their kinds.
pub(super) const WORDS: &[&str] = &[
    "a.osl\n",
    "-g\n4x4\n",
    "-p\nk=1\n",
    "-p\nc=1,0.5,0\n",
    "--outputs\no\n",
    "--uv-scale\n2,3\n",
    "--uv-offset\n-1,nan\n",
    "--center\n",
    "--shader-space\n1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n",
    "--userdata\nname=1,2,3\n",
    "--half\n",
    "--compression\npiz\n",
    "--repair\n",
    "--stats\n",
    "--profile\n",
    "--threads\n2\n",
    "--batch\n17\n",
    "--isa\nbaseline\n",
    "--arithmetic\nf64\n",
    "--closures\n",
    "--raytype\nshadow\n",
    "--texture-path\n.\n",
    "--texture-memory\n1\n",
    "--max-steps\n99\n",
    "--without-pass\nfold\n",
    "--group\nshader a A; shader b B; connect A.o B.x\n",
    "--layer\nA=a\n",
    "--connect\nA.o=B.x\n",
    "--on\nsphere\n",
    "--displace\no\n",
    "--edge-pixels\n2\n",
    "--level\n1\n",
    "--eye\n1,2,3\n",
    "--samples\n2\n",
    "--filter\ngaussian\n",
    "--crop\n0,2,1,3\n",
    "-p\nk=0:1:2\n",
    "--time\n0.5\n",
    "--global\nN=0,1,0\n",
    "--frames\n1-2\n",
    "--histogram\n",
    "compare\n",
    "--tolerance\n0.1\n",
    "--max-error\n0.1\n",
    "--deny\nwarnings\n",
    "--allow\nall\n",
    "-D\nA=1\n",
    "-I\n.\n",
    "--message-format\njson\n",
    "--strict-syntax\n",
    "check\n",
    "ir\n",
    "fmt\n--check\n",
    "compile\n-o\n-\n",
    "info\n--json\n",
    "explain\n--at\n1,1\n",
    "explain-error\nE0101\n",
    "doc\nnoise\n",
    "stability\n--points\n2x2\n--no-params\n",
    "render\na.ass\n-o\nb.exr\n",
    "testshade\n",
    "oslc\n",
    "oslinfo\n",
    "testrender\n",
    "-o\nx.exr\n",
    "-o\nx.png\n",
    "-param\nk\n2\n",
    "--param:type=float:lockgeom=0\nk\n2\n",
    "--expr\nresult = color(s, t, 0)\n",
    "-od\nhalf\n",
    "--print\n",
    "-shader\na\nL\n",
    "--options\nlazyglobals=0,searchpath:shader=.\n",
    "--reparam\nL\nk\n3\n",
    "--iters\n2\n",
    "-v\n",
    "--help\n",
    "-1\n",
    "inf\n",
    "\u{1b}[31m",
    "é",
    "=",
    ",",
    ":",
    "--",
];

/// Command lines for every command.
pub(super) fn seeds() -> Vec<Vec<u8>> {
    [
        "a.osl\n-g\n4x4\n-p\nk=0.5\n-p\nc=1,0.5,0\n--uv-scale\n2,3",
        "b.osl\n-g\n3x2\n-o\nx.exr\n--half\n--compression\nzip1\n--outputs\no",
        "--group\nshader a A; shader b B; connect A.o B.x\n-g\n2x2\n--shader-path\n.",
        "a.osl\n-g\n2x2\n--shader-space\n1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n--userdata\nname=1,2,3\n--arithmetic\nfast",
        "--layer\nA=a\n--layer\nB=b\n--connect\nA.o=B.x\n--shader-path\n.\n-g\n2x2\n--profile",
        "a.osl\n--on\nsphere\n-g\n6x4\n--displace\no\n--edge-pixels\n4\n-o\nx.png",
        "a.osl\n-g\n4x4\n--samples\n2\n--filter\ngaussian\n--filter-width\n2",
        "a.osl\n-g\n4x4\n--crop\n1,3,0,2\n--time\n2\n--frames\n1-2\n-o\nx#.png",
        "a.osl\n-g\n4x4\n-p\nk=0:1:2\n--histogram\n-o\nx.png",
        "compare\na.osl\n-g\n4x4\n--\n-p\nk=2",
        "compare\na.osl\nb.osl\n-g\n4x4\n-o\nx.png\n--tolerance\n0.1",
        "check\na.osl\nb.osl\n--deny\nwarnings",
        "ir\na.osl\n--stage\nafter\n--without-pass\nfold",
        "compile\na.osl\n-o\nx.oso",
        "info\n--json\nb.osl",
        "fmt\n--check\n--diff\na.osl",
        "explain\na.osl\n--at\n1,2\n-g\n4x4",
        "stability\na.osl\n--points\n2x2\n--no-params\n--json",
        "explain-error\nE0101",
        "doc\nsmoothstep",
        "testshade\n-g\n3\n2\n-param\nk\n2\na\n-o\no\nx.exr\n-od\nhalf",
        "testshade\n--expr\nresult = color(s, t, 0.5)\n-g\n2\n2\n--print\n-o\nresult\nnull",
        "testshade\n-g\n2\n2\n-shader\na\nA\n-shader\nb\nB\n-connect\nA\no\nB\nx\n--options\nlazyglobals=0\n--reparam\nA\nk\n3\n--iters\n2",
        "testshade\n--group\nshader a A; shader b B; connect A.o B.x\n--userdata:type=float[2]\nd\n1 2\n-o\no\nnull",
        "oslc\n-o\nx.oso\na.osl",
        "oslinfo\n-v\na.oso",
        "testrender\n-r\n3\n2\na.xml\nx.exr",
    ]
    .map(|text| text.as_bytes().to_vec())
    .into()
}

/// The files in the folder.
const FILES: [(&str, &str); 4] = [
    (
        "a.osl",
        "shader a(float k = 1 [[ float min = 0, float max = 2 ]], color c = 1, string s = \"x\", matrix m = 1, output float o = 0) { o = k * u + c[0] * m[0][0] + strlen(s); }\n",
    ),
    (
        "b.osl",
        "surface b(float x = 0, int n[3] = {1, 2, 3}, output color o = 0) { o = color(x, v, n[1]); Ci = o * diffuse(N); }\n",
    ),
    (
        "a.oso",
        "OpenShadingLanguage 1.00\nshader a\nparam\tfloat\tk\t1\noparam\tfloat\to\t0\ncode ___main___\n\tassign\t\to k \t%argrw{\"wr\"}\n\tend\n",
    ),
    (
        "a.xml",
        "<World><Camera eye=\"0,3,8\" look_at=\"0,1,0\" /><ShaderGroup>shader b l;</ShaderGroup><Sphere center=\"0,1,0\" radius=\"1\" /></World>",
    ),
];

/// The maximum product of the numbers in a command line that is run; more work than that is the user's
/// choice.
const LARGEST: u64 = 4096;

/// Maximum number of words in a command line.
const MAX_WORDS: usize = 24;

/// The folder in which command lines run. File names have no folders, so all files are written there.
static FOLDER: LazyLock<TempDir> = LazyLock::new(|| {
    #[expect(clippy::expect_used, reason = "without a temporary folder nothing can be tried")]
    let folder = tempfile::tempdir().expect("a temporary folder");
    // The working directory is that of the whole process: nothing else here uses relative names.
    assert!(std::env::set_current_dir(folder.path()).is_ok());
    folder
});

/// The number of command lines that ran; from time to time the folder is emptied.
static RUNS: AtomicU64 = AtomicU64::new(0);

/// Runs a command line in a folder with a few shaders. The exit code must be 0, 1 or 2, and 2 requires a
/// message.
pub fn arguments(bytes: &[u8]) -> u64 {
    let text = String::from_utf8_lossy(bytes);
    let plain = text.replace(['/', '\\', '\0'], "_").replace("..", "__");
    let mut words: Vec<String> = plain.lines().take(MAX_WORDS).map(str::to_string).collect();
    if asks_much(&words) {
        // What is read before the shader is missed is all that is to be seen.
        for word in words.iter_mut().filter(|word| FILES.iter().any(|(name, _)| name == *word)) {
            *word = "missing.osl".to_string();
        }
        if words.iter().any(|word| TOOLS.contains(&word.as_str())) {
            return 0;
        }
    }
    // These would wait for input, for a change, or for a page.
    if words.iter().any(|word| word.starts_with("--watch") || word == "studio") {
        return 0;
    }
    if words.iter().any(|word| word == "fmt") && words.iter().any(|word| word == "-") {
        return 0;
    }
    if RUNS.fetch_add(1, Ordering::Relaxed).is_multiple_of(64) {
        for entry in std::fs::read_dir(FOLDER.path()).into_iter().flatten().flatten() {
            let path = entry.path();
            let _ = std::fs::remove_file(&path).or_else(|_| std::fs::remove_dir_all(&path));
        }
        for (name, text) in FILES {
            let _ = std::fs::write(FOLDER.path().join(name), text);
        }
    }
    let program = OsString::from("oslrun");
    let (code, err) = command(std::iter::once(program).chain(words.iter().map(OsString::from)));
    assert!(code <= 2, "{words:?}: {code}");
    assert!(code != 2 || !err.is_empty(), "{words:?}: exit code 2 without a word");
    message(&err).wrapping_add(u64::from(code))
}

/// The commands whose first word may be no missing file but a text or an expression of its own.
const TOOLS: [&str; 6] = ["testshade", "testrender", "--group", "--expr", "-expr", "-group"];

/// Whether the product of the numbers in a command line, or a loop in its words, means much work.
fn asks_much(words: &[String]) -> bool {
    let digits = words.iter().flat_map(|word| word.split(|c: char| !c.is_ascii_digit()));
    let work = digits
        .filter(|text| !text.is_empty())
        .map(|text| text.parse::<u64>().unwrap_or(u64::MAX).max(1))
        .fold(1, u64::saturating_mul);
    let has_power = |word: &String| {
        let bytes = word.as_bytes();
        bytes.windows(2).any(|w| matches!(w, [digit, b'e' | b'E'] if digit.is_ascii_digit()))
    };
    let is_loop = |word: &String| word.contains("for") || word.contains("while") || word.contains("do ");
    work > LARGEST
        || words.iter().any(has_power)
        || words.iter().any(is_loop)
        || words.iter().any(|word| word == "tradeoff" || word == "render" || word == "inf")
}
