//! Shader groups against recorded runs: `tests/data/groups/CASE/`, with `group.txt`, the layers' sources, the
//! values of the last layer's outputs in `out.csv` and what was printed in `out.txt`.

use osl::stages::{self, ShaderFiles};
use osl_exec::{PointSource, RunOptions};
use osl_ir::passes;
use osl_lower::group::Group;
use osl_lower::{Last, Requests};
use osl_syntax::render::{RenderStyle, render};
use osl_syntax::source::SourceProvider;
use osl_syntax::{NoFiles, Options};
use osl_tests::golden::{Golden, compare};
use osl_tests::host;
use osl_tests::run;
use std::path::{Path, PathBuf};

/// The shaders of a folder.
struct Folder(PathBuf);

impl ShaderFiles for Folder {
    fn find(&self, shader: &str) -> Result<(String, String), String> {
        let file = format!("{shader}.osl");
        let text = std::fs::read_to_string(self.0.join(&file)).map_err(|e| e.to_string())?;
        Ok((file, text))
    }

    fn includes(&self) -> &dyn SourceProvider {
        &NoFiles
    }
}

/// The permitted absolute or relative error, for noise and approximations.
const TOLERANCE: f32 = 5e-6;

fn case(folder: &Path) -> Result<String, String> {
    let text = std::fs::read_to_string(folder.join("group.txt")).unwrap();
    let files = Folder(folder.to_path_buf());
    let checked = stages::check_group("group.txt", &text, "unnamed_group_1", &files, &Options::default());
    let group = checked.group.ok_or_else(|| format!("{:#?}", checked.diagnostics))?;
    let csv = [folder.join("out.csv"), folder.join("out.csv.gz")].into_iter().find(|p| p.is_file()).unwrap();
    let mut golden = Golden::load(&csv)?;
    golden.untangle(|_| false);
    let host = host::renderer(&golden);
    // The recorder requested the outputs of the last layer by their names, in any layer.
    let last = group.layers().last().unwrap().program.clone();
    let outputs = last.shader.params.iter().filter(|p| p.output);
    let outputs: Vec<_> = outputs.map(|p| last.vars[p.var.0 as usize].name.clone()).collect();
    let body = osl_lower::lower_group(&group, &outputs).map_err(|e| format!("{e:?}"))?;
    let passes = passes::Options {
        varying: host.varying().to_vec(),
        derivs: host.varying_derivs().to_vec(),
        traces: host.traces(),
        ..passes::Options::default()
    };
    let compiled = stages::finish(body, &passes);
    let frame = osl_exec::run(
        &compiled.program,
        &host::services(&golden, &host),
        &host,
        &RunOptions::default(),
        &|_| (),
    );
    let frame = frame.map_err(|e| e.to_string())?;
    let columns = run::columns(&frame);
    let (mut total, mut exact) = (0, 0);
    for (name, expected) in golden.columns.iter().filter(|(name, _)| name != "u" && name != "v") {
        let got = &columns.iter().find(|(n, _)| n == name).ok_or_else(|| format!("no output {name}"))?.1;
        let c = compare(expected, got, TOLERANCE);
        total += c.total;
        exact += c.exact;
        if c.within != c.total {
            return Err(format!("{name}: {} of {} differ, worst {:?}", c.total - c.within, c.total, c.worst));
        }
    }
    let place =
        |span| checked.sources.place(span).map_or_else(String::new, |p| format!("{}:{}", p.file, p.line));
    let mut said: String = frame.printed.iter().map(|p| p.text.as_str()).collect();
    for (error, line) in frame.said(place) {
        said += &format!("{}: {line}\n", if error { "ERROR" } else { "WARNING" });
    }
    let expected = std::fs::read_to_string(folder.join("out.txt")).unwrap_or_default();
    if said != expected {
        return Err(format!("printed\n{said}for\n{expected}"));
    }
    Ok(format!("{exact} of {total} values exact"))
}

#[test]
fn recorded_groups() {
    let mut folders: Vec<PathBuf> = std::fs::read_dir(run::root().join("tests/data/groups"))
        .unwrap()
        .map(|e| e.unwrap().path())
        .collect();
    folders.sort();
    assert_eq!(folders.len(), 40);
    let mut failed = 0;
    for folder in &folders {
        let name = folder.file_name().unwrap().to_string_lossy();
        match case(folder) {
            Ok(done) => println!("{name}: {done}"),
            Err(why) => {
                failed += 1;
                println!("FAILED {name}: {}", why.chars().take(1500).collect::<String>());
            }
        }
    }
    assert_eq!(failed, 0);
}

/// The shaders in the malformed groups.
struct Known;

impl ShaderFiles for Known {
    fn find(&self, shader: &str) -> Result<(String, String), String> {
        let text = match shader {
            "src" => {
                "struct S { float x; color c; };\nshader src(output float f = 0, output color c = 0, output S s = {0, 0}, output float a[3] = {0, 0, 0}, output string t = \"\") { f = u; }"
            }
            "dst" => {
                "shader dst(float x = 0, color k = 0, int i = 0, float b[2] = {0, 0}, float shut = 0 [[ int allowconnect = 0 ]], output float o = 0) { o = x; }"
            }
            "broken" => "shader broken(output float f = 0) { f = nothing; }",
            _ => return Err("there is no such file".to_string()),
        };
        Ok((format!("{shader}.osl"), text.to_string()))
    }

    fn includes(&self) -> &dyn SourceProvider {
        &NoFiles
    }
}

/// The diagnostics of a group, with the positions in its text.
fn said(text: &str) -> String {
    let checked = stages::check_group("bad.group", text, "g", &Known, &Options::default());
    let failed = checked.diagnostics.iter().any(|d| d.is_error());
    assert_eq!(failed, checked.group.is_none(), "{text}");
    render(&checked.diagnostics, &checked.sources, RenderStyle::default())
}

#[test]
fn malformed_groups() {
    let layers = "shader src A ;\nshader dst B ;\n";
    let cases = [
        "shader src A\nshader dst B ;",
        "param float x ;\nshader dst B ;",
        "param colour k 1 ;\nshader dst B ;",
        "param float x \"unfinished ;\nshader dst B ;",
        "param float x 1 [[ int nonsense = 1 ]] ;\nshader dst B ;",
        "param float x 1 [[ int lockgeom = 0 ;\nshader dst B ;",
        "shader ;\nconnect A.f ;\nnothing at all ;",
        "shader missing A ;",
        "shader broken A ;\nshader dst B ;",
        "shader src A ;\nshader dst A ;",
        "param float y 1 ;\nparam int x 1 ;\nparam color k 1 2 3 4 ;\nparam float[3] b 1 2 3 ;\nshader dst B ;",
        "shader dst B ;\nparam float x 1 ;",
        &format!("{layers}connect A.f C.x ;\nconnect D.f B.x ;"),
        &format!("{layers}connect A.g B.x ;\nconnect A.f B.y ;"),
        &format!("{layers}connect B.o A.f ;\nconnect A.f A.c ;"),
        &format!(
            "{layers}connect A.c B.x ;\nconnect A.f B.i ;\nconnect A.a B.b ;\nconnect A.t B.x ;\nconnect A.s B.x ;"
        ),
        &format!(
            "{layers}connect A.a[1] B.x ;\nconnect A.c[3] B.x ;\nconnect A.s.y B.x ;\nconnect A.f.x B.x ;"
        ),
        &format!("{layers}connect A.f B.shut ;"),
    ];
    let all: String =
        cases.iter().map(|text| format!("# {}\n{}\n", text.replace('\n', "\n# "), said(text))).collect();
    insta::assert_snapshot!(all);
}

/// What a group yields, and what its layers print, on a grid of four points.
/// Shaders by name.
struct Sources<'a>(&'a [(&'a str, &'a str)]);

impl ShaderFiles for Sources<'_> {
    fn find(&self, shader: &str) -> Result<(String, String), String> {
        let found = self.0.iter().find(|(name, _)| *name == shader).ok_or("no such shader")?;
        Ok((format!("{shader}.osl"), found.1.to_string()))
    }
    fn includes(&self) -> &dyn SourceProvider {
        &NoFiles
    }
}

fn run_text(
    text: &str,
    sources: &[(&str, &str)],
    outputs: &[&str],
) -> (Vec<(String, Vec<f32>)>, Vec<String>) {
    let checked = stages::check_group("test.group", text, "g", &Sources(sources), &Options::default());
    let group = checked.group.unwrap_or_else(|| panic!("{:#?}", checked.diagnostics));
    let outputs: Vec<_> = outputs.iter().map(|o| (*o).into()).collect();
    run_for(&group, &Requests { outputs, ..Requests::default() })
}

fn run_for(group: &Group, requests: &Requests) -> (Vec<(String, Vec<f32>)>, Vec<String>) {
    let body = osl_lower::lower_group_for(group, requests).unwrap();
    osl_ir::ir::validate::validate(&body).unwrap();
    let grid = osl_scene::Grid::new(2, 2);
    let compiled = stages::finish(
        body,
        &passes::Options { varying: grid.varying().to_vec(), ..passes::Options::default() },
    );
    let frame =
        osl_exec::run(&compiled.program, &run::services(), &grid, &RunOptions::default(), &|_| ()).unwrap();
    (run::columns(&frame), frame.printed.iter().map(|p| p.text.clone()).collect())
}

const SAY: &str =
    "shader say(string name = \"\", float x = 0, output float f = 0) { printf(\"%s \", name); f = x + u; }";

#[test]
fn a_layer_runs_once_and_only_where_it_is_read() {
    let root = "shader root(float a = 0, float b = 0, output float r = 0) { for (int i = 0; i < 3; i++) if (u > 0.5) r += a; r += b; }";
    let text = "param string name \"far\" ; shader say F ; param string name \"near\" ; shader say N ; \
                param string name \"none\" ; shader say X ; shader root R ; connect F.f N.x ; connect N.f R.a ; ";
    let (columns, printed) = run_text(text, &[("say", SAY), ("root", root)], &[]);
    assert_eq!(columns[0], ("r".to_string(), vec![0.0, 6.0, 0.0, 6.0]));
    // It is read in a loop, so it runs before the loop, at every point; its own source runs after it has
    // printed.
    assert_eq!(printed.concat(), "near far ".repeat(4));
    let root = "shader root(float a = 0, float b = 0, output float r = 0) { if (u > 0.5) { r = a; } }";
    let (_, printed) = run_text(text, &[("say", SAY), ("root", root)], &[]);
    assert_eq!(printed.concat(), "near far ".repeat(2));
}

#[test]
fn outputs_of_other_layers_can_be_asked_for() {
    let root = "shader root(float a = 7, output float r = 0) { r = a; }";
    let text = "param string name \"s\" ; shader say S ; shader root R ; ";
    let (columns, printed) = run_text(text, &[("say", SAY), ("root", root)], &["S.f"]);
    let names: Vec<&str> = columns.iter().map(|(n, _)| n.as_str()).collect();
    assert_eq!((names, printed.len()), (vec!["S.f", "r"], 4));
    assert_eq!(columns[0].1, [0.0, 1.0, 0.0, 1.0]);
}

#[test]
fn an_input_is_handed_on_and_an_output_is_connected_to() {
    let pass = "shader pass(float x = 1, output float y = 2) { }";
    let root = "shader root(float a = 0, float b = 0, output float r = 0) { r = a + 10 * b; }";
    let text = "param string name \"\" ; shader say S ; shader pass P ; shader root R ; \
                connect S.f P.x ; connect S.f P.y ; connect P.x R.a ; connect P.y R.b ;";
    let (columns, _) = run_text(text, &[("say", SAY), ("pass", pass), ("root", root)], &[]);
    assert_eq!(columns[0].1, [0.0, 11.0, 0.0, 11.0]);
}

#[test]
fn blank_statements_mean_nothing_and_components_have_names() {
    let src = "shader src(output color c = color(u, v, 7), output point p = point(u, 2, 3)) { }";
    let dst = "shader dst(float x = 0, vector w = 0, output vector r = 0) { r = w + x; }";
    let sources = [("src", src), ("dst", dst)];
    let red = |text: &str| run_text(text, &sources, &[]).0.iter().map(|(_, v)| v[1]).collect::<Vec<f32>>();
    let text = "; shader src A ;; ,shader dst B, ;; connect A.c.b B.x ; connect A.p.x B.w.y ; ;";
    assert_eq!(red(text), [7.0, 8.0, 7.0]);
    assert_eq!(red(text), red("shader src A ; shader dst B ; connect A.c[2] B.x ; connect A.p[0] B.w[1] ;"));
    // A layer without a name has that of its shader, not of the file.
    assert_eq!(
        red("shader src ; shader dst ; connect src_0.c.g dst_1.x"),
        red("shader src A; shader dst B; connect A.c[1] B.x;")
    );
}

#[test]
fn an_entry_excludes_what_runs_unasked() {
    let tell =
        "shader tell(string name = \"\", float x = 0, output float f = 1) { printf(\"%s%g \", name, x); }";
    let layers = "param string name \"a\"; shader tell A; param string name \"b\"; shader tell B; \
                  param string name \"c\"; shader tell C; connect A.f B.x;";
    let checked =
        stages::check_group("test.group", layers, "g", &Sources(&[("tell", tell)]), &Options::default());
    let mut group = checked.group.unwrap();
    let last = Last::Named(Vec::new());
    let mut printed = |entries: Option<Vec<usize>>| {
        (group.rules.entries, group.rules.eager_unconnected) = (entries, true);
        run_for(&group, &Requests { last: last.clone(), ..Requests::default() }).1.concat()
    };
    assert_eq!(printed(None), "a0 b1 c0 ".repeat(4));
    assert_eq!(printed(Some(vec![2])), "c0 ".repeat(4));
    assert_eq!(printed(Some(vec![2, 1])), "c0 a0 b1 ".repeat(4));
}

/// The printed text of two connected layers; `own` are the outputs of the second layer that the renderer
/// requests.
fn said_for(sources: &[(&str, &str)], text: &str, own: &[&str], userdata_isconnected: bool) -> String {
    let checked = stages::check_group("test.group", text, "g", &Sources(sources), &Options::default());
    let mut group = checked.group.unwrap_or_else(|| panic!("{:#?}", checked.diagnostics));
    group.rules.userdata_connected = userdata_isconnected;
    let last = Last::Named(own.iter().map(|o| (*o).into()).collect());
    let requests = Requests { last, ..Requests::default() };
    let (columns, printed) = run_for(&group, &requests);
    let names: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
    format!("{} {}", names.join(" "), printed.first().map_or("", |first| first.trim_end()))
}

const PAIR: &str = "struct pair { float x; float y; };";

#[test]
fn isconnected_looks_at_fields_and_at_what_the_renderer_takes() {
    let up = &format!("{PAIR} shader up(output pair p = {{1, 2}}, output float idle = 0) {{ }}");
    let down = &format!(
        "{PAIR} int of(pair q) {{ return isconnected(q.y) * 10 + isconnected(q); }}
        shader down(pair p = {{0, 0}}, float d = 0 [[ int lockgeom = 0 ]], output float a = 0, output pair b = {{0, 0}}) {{
            a = p.x + p.y;
            printf(\"%d %d %d %02d %d %d %d %d\", isconnected(p), isconnected(p.x), isconnected(p.y), of(p), isconnected(d),
                isconnected(a), isconnected(b), isconnected(b.y));
        }}"
    );
    let sources = [("up", up.as_str()), ("down", down.as_str())];
    let group = |connections: &str| format!("shader up U ; shader down D ; {connections}");
    for (connections, own, userdata, expected) in [
        ("connect U.p D.p ;", &["a"][..], false, "a 1 1 1 11 0 2 0 0"),
        ("connect U.p.y D.p.y ;", &["D.a"], false, "a 0 0 1 10 0 2 0 0"),
        ("connect U.p.x D.p.x ;", &["b"], false, "b.x b.y 1 1 0 01 0 0 2 2"),
        ("", &["a", "b.y"], true, "a b.x b.y 0 0 0 00 1 2 0 2"),
        ("connect U.idle D.d ;", &["a"], false, "a 0 0 0 00 1 2 0 0"),
    ] {
        assert_eq!(said_for(&sources, &group(connections), own, userdata), expected, "{connections}");
    }
}

#[test]
fn layers_run_only_for_what_somebody_takes() {
    let up = "shader up(string name = \"\", float in = 0, output float f = 0, output float g = 0) \
              { f = u; g = in; printf(\"%s \", name); }";
    let down = "shader down(float x = 0, float y = 0, output float a = 0, output float b = 0) \
                { float twice = 2 * x; if (u < 2) { a = twice; } for (int k = 0; k < 3; ++k) b += y; }";
    let text = "param string name \"A\" ; shader up A ; param string name \"B\" ; shader up B ; \
                param string name \"C\" ; shader up C ; shader down D ; \
                connect A.f B.in ; connect B.f C.in ; connect B.g D.x ; connect C.f D.y ;";
    for (own, expected) in [
        (&["a", "b"][..], "a b A B C"),
        (&["a"], "a A B"),
        // C uses the output of B only for an output that is not requested.
        (&["b"], "b C"),
        (&[], ""),
    ] {
        let (columns, printed) = {
            let checked = stages::check_group(
                "test.group",
                text,
                "g",
                &Sources(&[("up", up), ("down", down)]),
                &Options::default(),
            );
            let last = Last::Named(own.iter().map(|o| (*o).into()).collect());
            run_for(&checked.group.unwrap(), &Requests { last, ..Requests::default() })
        };
        let mut layers: Vec<&str> = printed.iter().map(|text| text.trim()).collect();
        layers.sort_unstable();
        layers.dedup();
        let names = columns.iter().map(|(name, _)| name.as_str());
        assert_eq!(names.chain(layers).collect::<Vec<_>>().join(" "), expected);
    }
}

#[test]
fn messages_and_globals_are_taken_by_whoever_runs() {
    let set = "shader set(output float f = 0) { setmessage(\"m\", 5.0); P = 7; f = 1; }";
    let get = "shader get(float x = 0, output float a = 0) \
               { a = x; float m = 0; int r = getmessage(\"m\", m); a += m + P[0]; }";
    let (columns, _) =
        run_text("shader set S ; shader get G ; connect S.f G.x ;", &[("set", set), ("get", get)], &[]);
    assert_eq!(columns[0].1[0], 13.0);
}
