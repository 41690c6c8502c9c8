//! `picture-book`: pages about shaders.

use crate::in_process::oslrun;
use base64::Engine;
use osl_image::{ImageData, read_image};
use std::path::{Path, PathBuf};

fn seed(name: &str) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    root.join("osl").join(name).display().to_string()
}

/// The page of a shader.
fn book(file: &str, more: &[&str]) -> String {
    let dir = tempfile::tempdir().unwrap();
    let page = dir.path().join("book.html").display().to_string();
    let (code, out, err) = oslrun(&[&["picture-book", file, "-o", &page], more].concat());
    assert_eq!(code, 0, "{file}: {err}");
    assert!(out.contains("wrote "), "{out}");
    std::fs::read_to_string(page).unwrap()
}

/// The page of a text.
fn book_of(text: &str, more: &[&str]) -> String {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("s.osl");
    std::fs::write(&file, text).unwrap();
    book(&file.display().to_string(), more)
}

/// The elements that a page may have, besides those that HTML does not close.
const CLOSED: [&str; 22] = [
    "html",
    "head",
    "style",
    "title",
    "body",
    "h1",
    "h2",
    "p",
    "span",
    "figure",
    "figcaption",
    "b",
    "i",
    "table",
    "colgroup",
    "tr",
    "td",
    "code",
    "div",
    "th",
    "details",
    "summary",
];
const OPEN: [&str; 4] = ["!doctype", "meta", "img", "col"];

/// Checks that each element of a page is known, closed, and properly nested.
fn is_whole(page: &str) {
    let (start, rest) = page.split_once("<style>").unwrap();
    let (_, end) = rest.split_once("</style>").unwrap();
    let mut open: Vec<String> = Vec::new();
    for text in [start, end] {
        for tag in text.split('<').skip(1) {
            let (tag, _) = tag.split_once('>').unwrap_or_else(|| panic!("unescaped: {tag}"));
            if let Some(name) = tag.strip_prefix('/') {
                assert_eq!(open.pop().as_deref(), Some(name), "</{name}>");
                continue;
            }
            let name = tag.split([' ', '\n']).next().unwrap();
            if CLOSED.contains(&name) {
                open.push(name.to_string());
            } else {
                assert!(OPEN.contains(&name), "<{tag}>");
            }
            let outside: String = tag.split('"').step_by(2).collect();
            assert!(!outside.contains(" on"), "no scripts: <{tag}>");
        }
    }
    assert_eq!(open, Vec::<String>::new());
}

/// The row of a line.
fn row(page: &str, line: u32) -> &str {
    let (_, rest) = page.split_once(&format!(" id=L{line}>")).unwrap_or_else(|| panic!("line {line}"));
    rest.split_once("</tr>").unwrap().0
}

/// The pictures of a variable at a line: the last value, then the first times.
fn pictures(page: &str, line: u32, name: &str) -> Vec<ImageData> {
    let figures = row(page, line).split("<figure>").skip(1);
    let mut named = figures.filter(|figure| figure.contains(&format!("<b>{name}</b>")));
    let figure = named.next().unwrap_or_else(|| panic!("{name} of line {line}: {}", row(page, line)));
    let urls = figure.split("data:image/png;base64,").skip(1).map(|rest| rest.split_once('"').unwrap().0);
    let bytes = urls.map(|url| base64::engine::general_purpose::STANDARD.decode(url).unwrap());
    bytes.map(|bytes| decode(&bytes)).collect()
}

fn decode(bytes: &[u8]) -> ImageData {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.png");
    std::fs::write(&path, bytes).unwrap();
    read_image(&path).unwrap()
}

/// The words of a picture.
fn words(page: &str, line: u32, name: &str) -> String {
    let (_, rest) = row(page, line).split_once(&format!("<b>{name}</b> <span class=dim>")).unwrap();
    rest.split_once("</span>").unwrap().0.to_string()
}

/// A file, options, and variables with their lines.
type Expected<'a> = (&'a str, &'a [&'a str], &'a [(u32, &'a str)]);

#[test]
fn the_seeds_have_pages() {
    let books: [Expected<'_>; 6] = [
        ("Cobbled.osl", &[], &[(22, "pp"), (34, "dist"), (36, "outCells"), (47, "intHSV3"), (82, "disp")]),
        (
            "flakes.osl",
            &[],
            &[(30, "position"), (45, "cellDistance"), (48, "nearestCellIndex"), (61, "result")],
        ),
        ("sprinkles.osl", &["--repair"], &[]),
        ("strips.osl", &[], &[(18, "position"), (27, "k"), (70, "UV"), (70, "strip"), (78, "Fac")]),
        ("nonlinear_noise.osl", &[], &[(68, "tangent_u"), (79, "here"), (91, "disp")]),
        ("chaosmosaic.osl", &[], &[(10, "x"), (17, "xp"), (22, "Color")]),
    ];
    for (name, more, variables) in books {
        let page = book(&seed(name), &[more, &["-g", "24x24"]].concat());
        assert!(page.len() < 2_000_000, "{name}: {} bytes", page.len());
        is_whole(&page);
        assert!(!page.contains("http:") && !page.contains("https:"), "nothing from elsewhere");
        for (line, variable) in variables {
            assert!(row(&page, *line).contains(&format!("<b>{variable}</b>")), "{name} {line}: {variable}");
        }
        assert!(
            page.contains("<b>if</b>") || page.contains("<b>rounds</b>") || name.starts_with("chaos"),
            "{name}"
        );
    }
}

const SHADER: &str = "surface s(float k = 3 [[ string help = \"How many\", float min = 0, float max = 9 ]],
    output float o = 0)
{
    float a = u + v;
    vector d = normalize(vector(u - 0.5, v - 0.5, 1));
    color c = color(u, v, 2 * u);
    int id = int(floor(3 * u)) * 10;
    float list[2];
    list[1] = u - 0.5;
    for (int i = 0; i < 5; i++) {
        if (u > 0.5 && i > 1)
            a += v;
    }
    if (v > 0.3) {
        o = a;
    } else if (u < 2)
        a = 1;
    float never = 1e38 * (u - 20) * 1e10 + u / 0;
}
";

#[test]
fn pictures_are_those_of_taps() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("s.osl").display().to_string();
    std::fs::write(&file, SHADER).unwrap();
    let page = book(&file, &["-g", "9x7"]);
    is_whole(&page);
    let taps: [(&str, u32, &str, &[&str]); 3] =
        [("4:a", 4, "a", &["--range", "auto"]), ("5:d", 5, "d", &["--signed"]), ("6:c", 6, "c", &[])];
    for (tap, line, name, more) in &taps {
        let picture = dir.path().join("tap.png").display().to_string();
        let args = [&[file.as_str(), "-g", "9x7", "--tap", tap, "-o", &picture], *more].concat();
        let (code, _, err) = oslrun(&args);
        assert_eq!(code, 0, "{err}");
        let expected = read_image(Path::new(&picture)).unwrap();
        let found = &pictures(&page, *line, name)[0];
        assert_eq!((found.width, found.height), (9, 7), "{tap}");
        for at in 0..expected.channels.len() {
            assert_eq!(found.plane(at), expected.plane(at), "{tap}, channel {at}");
        }
    }
}

/// The words of a command line of a page, whose words may be in quotes.
fn typed(command: &str) -> Vec<String> {
    let mut words = Vec::new();
    for (at, part) in command.split('\'').enumerate() {
        match at % 2 {
            0 => words.extend(part.split_whitespace().map(str::to_string)),
            _ => words.push(part.to_string()),
        }
    }
    words
}

/// Each command of a page writes the picture above it, unless the page says how it differs.
#[test]
fn commands_of_pictures_write_them() {
    let dir = tempfile::tempdir().unwrap();
    let own = dir.path().join("s.osl").display().to_string();
    std::fs::write(&own, SHADER).unwrap();
    let flakes = seed("flakes.osl");
    let books: [(&str, &[&str]); 3] = [
        (&own, &["-g", "9x7", "-p", "k=4", "--uv-scale", "2,3", "--time", "2"]),
        (&own, &["--grid=9x7", "--center"]),
        (&flakes, &["-g", "16x16"]),
    ];
    let (mut same, mut different) = (0, 0);
    for (file, more) in books {
        let page = book(file, more).replace("&#39;", "'");
        for figure in page.split("<figure>").skip(1) {
            let Some((before, rest)) = figure.split_once("<summary>command</summary><code>") else {
                continue;
            };
            let (command, after) = rest.split_once("</code>").unwrap();
            let folder = tempfile::tempdir().unwrap();
            let picture = folder.path().join("one.png").display().to_string();
            let mut words = typed(command);
            assert_eq!((&*words.remove(0), words.pop().as_deref()), ("oslrun", Some("picture.png")));
            let words: Vec<&str> = words.iter().map(String::as_str).chain([&*picture]).collect();
            let (code, _, err) = oslrun(&words);
            assert_eq!(code, 0, "{command}: {err}");
            // Of two files, the second one has the points that get to the line.
            let files = std::fs::read_dir(&folder).unwrap().map(|file| file.unwrap().path());
            let mut files: Vec<PathBuf> = files.collect();
            files.sort_by_key(|file| file.as_os_str().len());
            assert_eq!(
                files.len(),
                1 + usize::from(after.contains("writes two files")),
                "{command}: {files:?}"
            );
            let written = read_image(&files[0]).unwrap();
            let (_, url) = before.split_once("data:image/png;base64,").unwrap();
            let url = url.split_once('"').unwrap().0;
            let shown = decode(&base64::engine::general_purpose::STANDARD.decode(url).unwrap());
            assert_eq!((written.width, written.height), (shown.width, shown.height), "{command}");
            if after.starts_with(" <span>shows the values: ") {
                different += 1;
                continue;
            }
            same += 1;
            let mask = shown.channels.len().is_multiple_of(2).then(|| shown.plane(shown.channels.len() - 1));
            for channel in 0..shown.channels.len() - usize::from(mask.is_some()) {
                // A picture of three equal components is grey.
                let written = written.plane(channel.min(written.channels.len() - 1));
                for (at, (a, b)) in shown.plane(channel).iter().zip(written).enumerate() {
                    let counts = mask.as_ref().is_none_or(|mask| mask[at] > 0.0);
                    assert!(!counts || *a == b, "{command}: {a} {b} at {at} of {channel}");
                }
            }
        }
    }
    assert!(same > 20 && different > 3, "{same} {different}");
}

#[test]
fn a_page_says_how_it_was_made() {
    let more = ["-g", "6x5", "--time", "2", "--global", "N=0,0,1", "--raytype", "shadow", "--allow-files"];
    let page = book_of(SHADER, &more);
    let (_, made) = page.split_once("Made with oslrun ").unwrap();
    let (_, command) = made.split_once("<code>oslrun picture-book ").unwrap();
    let said = "-g 6x5 --time 2 --global N=0,0,1 --raytype shadow --allow-files</code>";
    assert!(command.split_once("book.html ").is_some_and(|(_, rest)| rest.starts_with(said)), "{command}");
    let tap = "--time 2 --global N=0,0,1 --raytype shadow --allow-files -g 6x5 --tap 4:a";
    assert!(page.contains(tap), "{page}");
    assert!(!page.contains("book.html --time"), "a picture does not go to the page");
}

#[test]
fn what_has_no_picture_is_said() {
    let page =
        book_of("shader s(output matrix m = 1, output string t = \"\", output float r = 0) { r = u; }", &[]);
    assert!(page.contains("<b>m</b> <span class=dim>a matrix has no picture"), "{page}");
    assert!(!page.contains("<b>t</b>"), "numbers alone are outputs of a picture");
    assert!(page.contains("Matrices, strings and closures have no picture."), "{page}");
}

#[test]
fn pictures_say_how_to_read_them() {
    let page = book_of(SHADER, &["-g", "9x7"]);
    assert_eq!(words(&page, 4, "a"), "0 to 2, from black to white");
    assert_eq!(words(&page, 5, "d"), "direction, as in a normal map");
    assert_eq!(words(&page, 6, "c"), "0 to 2, cut to 0 to 1");
    assert_eq!(words(&page, 7, "id"), "4 different numbers, each with its color, 0 to 30");
    assert_eq!(words(&page, 9, "list[1]"), "-0.5 to 0.5; blue is negative, white 0, orange positive");
    assert_eq!(words(&page, 10, "rounds"), "5 everywhere");
    assert_eq!(words(&page, 10, "i"), "5 everywhere; first 0, then 1, then 2");
    assert_eq!(
        words(&page, 11, "if"),
        "true (white) at no point, false (black) at 56 % of the points, in turns (grey) at 44 % of the points; true 27 % of the times"
    );
    assert!(words(&page, 12, "a").ends_with(", at 44 % of the points"), "{}", words(&page, 12, "a"));
    // The last value and three times, with a share that covers the background.
    let rounds = pictures(&page, 12, "a");
    assert_eq!((rounds.len(), rounds[0].channels.len()), (4, 2));
    assert!(
        words(&page, 16, "if").starts_with("true (white) at 29 % of the points, false (black) at no point")
    );
    assert!(words(&page, 18, "never").contains("NaN or infinite"), "{}", words(&page, 18, "never"));
    assert!(row(&page, 18).contains("division"), "a warning at its line: {}", row(&page, 18));
    for part in ["How many", "min", "max", "<code>3.0</code>", "oslrun picture-book "] {
        assert!(page.contains(part), "{part}");
    }
    assert!(book_of(SHADER, &["-g", "4x4", "-p", "k=5"]).contains("5 (given)"));
}

#[test]
fn jumps_and_hidden_variables() {
    let text = "float f(float x)
{
    if (x > 0.5)
        return 1;
    return 2;
}
shader s(output float o = 0)
{
    for (int i = 0; i < 6; i++) {
        if (u > 0.5)
            break;
        if (i == 2) continue;
        o += f(v);
    }
    float y = 1; { float y = 2; }
    if (v > 0.5) { if (u > 0.5) exit(); }
    o += y;
}
";
    let page = book_of(text, &["-g", "4x4"]);
    assert_eq!(words(&page, 9, "rounds"), "1 to 6, from black to white", "also a round that is left");
    assert!(words(&page, 10, "if").starts_with("true (white) at 50 % of the points, false (black) at 50 %"));
    let of_some = words(&page, 12, "if");
    assert!(
        of_some.starts_with("true (white) at no point, false (black) at no point, in turns (grey) at 50 %"),
        "{of_some}"
    );
    assert!(of_some.ends_with("true 17 % of the times"), "{of_some}");
    assert!(words(&page, 3, "if").starts_with("true (white) at 25 % of the points, false (black) at 25 %"));
    assert_eq!(words(&page, 15, "y"), "2 everywhere");
    assert_eq!(row(&page, 15).matches("<figure>").count(), 1, "a tap of `y` there shows the inner one");
    assert!(words(&page, 17, "o").ends_with(", at 75 % of the points"));
}

#[test]
fn text_of_a_shader_stays_text() {
    let text = "shader s(string name = \"<script>alert(1)</script>\" [[ string help = \"</td><img src=x onerror=alert(1)>\" ]],
    float a = 1 [[ string label = \"'\\\"><svg onload=alert(1)>\" ]], output float o = 0)
[[ string help = \"<b>bold</b> \u{202e}\" ]]
{
    // </table><script>alert(1)</script> &amp; \u{1b}[31m
    string s = \"<script>\"; /* <style>
    </style> */ o = u; warning(\"<img src=x onerror=alert(2)> %g\", u);
#define LESS(a) (a < 1)
    if (LESS(u)) o = 2;
}
";
    let dir = tempfile::tempdir().unwrap();
    let names: &[&str] = if cfg!(unix) { &["'\"><svg onload=alert(1)>.osl", "a.osl"] } else { &["a.osl"] };
    for name in names {
        let file: PathBuf = dir.path().join(name);
        std::fs::write(&file, text).unwrap();
        let page = book(&file.display().to_string(), &["-g", "4x4"]);
        is_whole(&page);
        assert!(!page.contains("<script") && !page.contains("<svg"), "{page}");
        let bad = page.chars().find(|c| osl_syntax::escape::is_control(*c) && !matches!(c, '\n' | '\t'));
        assert_eq!(bad, None);
        assert!(row(&page, 7).contains("&lt;img src=x"), "{}", row(&page, 7));
    }
}

#[test]
fn a_page_is_bounded() {
    let page = book_of(SHADER, &["-g", "4x4", "--limit", "running.book_pictures=3"]);
    is_whole(&page);
    assert!(page.contains("pictures of later lines are left out"), "{page}");
    assert!(row(&page, 4).contains("<b>a</b>") && !row(&page, 9).contains("<b>"), "from the end");
}

#[test]
fn mistakes_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("s.osl").display().to_string();
    let page = dir.path().join("book.html").display().to_string();
    std::fs::write(&file, SHADER).unwrap();
    let said = |args: &[&str]| {
        let (code, out, err) = oslrun(&[&["picture-book"], args].concat());
        assert_eq!((code, out.as_str()), (2, ""), "{args:?}");
        err
    };
    assert!(said(&[&file]).contains("--output <BOOK.html>"));
    assert!(said(&[&file, "-o", "a.png"]).contains("must end in .html"));
    assert!(said(&[&file, "-o", &page, "-g", "500x5"]).contains("at most 128x128"));
    assert!(said(&["a.oso", "-o", &page]).contains("the source of one shader"));
    assert!(said(&[&file, "-o", &page, "--tap", "4:a"]).contains("--tap has no effect in `picture-book`"));
    assert!(said(&[&file, "-o", &page, "--on", "sphere"]).contains("--on has no effect"));
    std::fs::write(&file, "shader s() { o = 1; }").unwrap();
    let (code, _, err) = oslrun(&["picture-book", &file, "-o", &page]);
    assert!(code == 1 && err.contains('o') && !Path::new(&page).exists(), "{err}");
}
