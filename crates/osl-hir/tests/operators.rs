//! Every operator on every pair of types, every conversion, cast, condition and constructor: whether it is
//! accepted, and the type of its value.
//!
//! The tables are those of the OSL language specification, chapters on types and expressions, with the
//! behaviour of published compilers where it is silent. `.` is an error. The letters are the variables of
//! [`DECLARATIONS`].

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use osl_hir::hir::StmtKind;
use osl_hir::resolve::resolve;
use osl_syntax::{NoFiles, Options, parse};
use std::collections::BTreeMap;

/// One variable of each type, by its letter in the tables; `q` is a struct, `a` an array.
const DECLARATIONS: &str = "int i; float f; color c; point p; vector w; normal n; matrix m; string s; \
                            closure color K; S q; float a[2];";
const LETTERS: &str = "i f c p w n m s K q a";

/// The result of a statement.
#[derive(Debug, Default)]
struct Verdict {
    /// Letter of its value's type, `.` after an error.
    ty: String,
    /// Codes of its diagnostics.
    codes: Vec<&'static str>,
}

impl Verdict {
    fn is_error(&self) -> bool {
        self.codes.iter().any(|code| code.starts_with('E'))
    }
}

fn letter(name: &str) -> &'static str {
    match name {
        "int" => "i",
        "float" => "f",
        "color" => "c",
        "point" => "p",
        "vector" => "w",
        "normal" => "n",
        "matrix" => "m",
        "string" => "s",
        "closure color" => "K",
        "S" => "q",
        "float[2]" => "a",
        _ => "?",
    }
}

/// Resolves the statements in shaders with the declarations, preceded by `file`; in groups small enough that
/// no error exceeds the limit.
fn judge(file: &str, statements: &[String]) -> Vec<Verdict> {
    statements.chunks(60).flat_map(|some| judge_some(file, some)).collect()
}

/// Resolves the statements, one a line, in one shader.
fn judge_some(file: &str, statements: &[String]) -> Vec<Verdict> {
    let text = format!(
        "struct S {{ float x; }}; struct T {{ float x; }}; {file} shader t() {{ {DECLARATIONS} T other;\n{}\n}}",
        statements.join("\n")
    );
    let parsed = parse("t.osl", &text, &NoFiles, &Options::default());
    assert!(!parsed.has_errors(), "{:?}", parsed.diagnostics);
    let resolved = resolve(&parsed.ast);
    let mut verdicts: Vec<Verdict> = statements.iter().map(|_| Verdict::default()).collect();
    for d in &resolved.diagnostics {
        let line = parsed.sources.place(d.span).unwrap().line as usize;
        verdicts[line - 2].codes.push(d.code.id);
    }
    let program = resolved.program.map_or_else(|broken| broken, Into::into);
    for stmt in program.shader.iter().flat_map(|shader| &shader.body) {
        let line = parsed.sources.place(stmt.span).unwrap().line as usize;
        if let (2.., StmtKind::Expr(e)) = (line, &stmt.kind) {
            verdicts[line - 2].ty = letter(&program.structs.show(e.ty)).to_string();
        }
    }
    verdicts.iter_mut().filter(|v| v.is_error()).for_each(|v| v.ty = ".".to_string());
    verdicts
}

/// Cells of a table by row and column.
type Table = BTreeMap<(String, String), String>;

/// Reads a table; combinations that it does not list are errors.
fn table(text: &str) -> Table {
    let mut lines = text.lines().map(str::trim).filter(|l| !l.is_empty());
    let columns: Vec<&str> = lines.next().unwrap_or_default().split_whitespace().collect();
    let mut cells = Table::new();
    for line in lines {
        let mut words = line.split_whitespace();
        let row = words.next().unwrap_or_default();
        for (column, cell) in columns.iter().zip(words) {
            cells.insert((row.to_string(), column.to_string()), cell.to_string());
        }
    }
    cells
}

fn cell<'t>(table: &'t Table, row: &str, column: &str) -> &'t str {
    table.get(&(row.to_string(), column.to_string())).map_or(".", String::as_str)
}

fn pairs() -> Vec<(&'static str, &'static str)> {
    LETTERS.split(' ').flat_map(|l| LETTERS.split(' ').map(move |r| (l, r))).collect()
}

const SUM: &str = "
      i f c p w n m K
    i i f c p w n . .
    f f f c p w n . .
    c c c c p c c . .
    p p p p p p p . .
    w w w w p w w . .
    n n n n p n n . .
    m . . . . . . . .
    K . . . . . . . K";

const DIFFERENCE: &str = "
      i f c p w n m K
    i i f c p w n . .
    f f f c p w n . .
    c c c c p c c . .
    p p p p w p p . .
    w w w w p w w . .
    n n n n p n n . .";

const PRODUCT: &str = "
      i f c p w n m K
    i i f c p w n m K
    f f f c p w n m K
    c c c c c c c . K
    p p p p p p p . .
    w w w w w w w . .
    n n n n n n n . .
    m m m . . . . m .
    K K K K . . . . .";

const QUOTIENT: &str = "
      i f c p w n m K
    i i f c p w n m .
    f f f c p w n m .
    c c c c c c c . .
    p p p p p p p . .
    w w w w w w w . .
    n n n n n n n . .
    m m m . . . . m .";

const INTEGERS: &str = "
      i
    i i";

const ORDER: &str = "
      i f
    i i i
    f i i";

const EQUALITY: &str = "
      i f c p w n m s
    i i i i i i i i .
    f i i i i i i i .
    c i i i i i i . .
    p i i i i i i . .
    w i i i i i i . .
    n i i i i i i . .
    m i i . . . . i .
    s . . . . . . . i";

const LOGIC: &str = "
      i f c p w n m s K
    i i i i i i i i i i
    f i i i i i i i i i
    c i i i i i i i i i
    p i i i i i i i i i
    w i i i i i i i i i
    n i i i i i i i i i
    m i i i i i i i i i
    s i i i i i i i i i
    K i i i i i i i i i";

const BINARY: &[(&str, &str)] = &[
    ("+", SUM),
    ("-", DIFFERENCE),
    ("*", PRODUCT),
    ("/", QUOTIENT),
    ("%", INTEGERS),
    ("&", INTEGERS),
    ("|", INTEGERS),
    ("^", INTEGERS),
    ("<<", INTEGERS),
    (">>", INTEGERS),
    ("==", EQUALITY),
    ("!=", EQUALITY),
    ("<", ORDER),
    ("<=", ORDER),
    (">", ORDER),
    (">=", ORDER),
    ("&&", LOGIC),
    ("||", LOGIC),
];

/// Of two kinds of triples, the type of the last one counts.
const TERNARY: &str = "
      i f c p w n m s
    i i f c p w n m .
    f f f c p w n m .
    c c c c p w n . .
    p p p c p w n . .
    w w w c p w n . .
    n n n c p w n . .
    m m m . . . . m .
    s . . . . . . . s";

/// Destination by source: `=` unchanged, `>` converted, `!` converted with a warning.
const ASSIGNED: &str = "
      i f c p w n m s K q a
    i = ! . . . . . . . . .
    f > = . . . . . . . . .
    c > > = > > > . . . . .
    p > > > = > > . . . . .
    w > > > > = > . . . . .
    n > > > > > = . . . . .
    m > > . . . . = . . . .
    s . . . . . . . = . . .
    K . . . . . . . . = . .
    q . . . . . . . . . = .
    a . . . . . . . . . . =";

/// Type by operand.
const CAST: &str = "
      i f c p w n m s K
    i i i . . . . . . .
    f f f . . . . . . .
    c c c c c c c . . .
    p p p p p p p . . .
    w w w w w w w . . .
    n n n n n n n . . .
    m m m . . . . m . .
    s . . . . . . . s .";

fn check(statements: Vec<(String, String)>, file: &str) {
    let (texts, wanted): (Vec<String>, Vec<String>) = statements.into_iter().unzip();
    let verdicts = judge(file, &texts);
    let differ: Vec<String> = verdicts
        .iter()
        .zip(texts.iter().zip(&wanted))
        .filter(|(v, (_, wanted))| v.ty != **wanted)
        .map(|(v, (text, wanted))| format!("{text} is {wanted}, not {} {:?}", v.ty, v.codes))
        .collect();
    assert!(differ.is_empty(), "{}", differ.join("\n"));
}

#[test]
fn binary_operators() {
    for (op, text) in BINARY {
        let table = table(text);
        let expected = |(l, r)| (format!("{l} {op} {r};"), cell(&table, l, r).to_string());
        check(pairs().into_iter().map(expected).collect(), "");
    }
}

/// `a op= b` is `a = a op b`.
#[test]
fn compound_assignments() {
    let assigned = table(ASSIGNED);
    for (op, text) in BINARY.iter().filter(|(op, _)| "+-*/&|^<<>>".contains(op) && !op.contains("||")) {
        let table = table(text);
        let expected = |(l, r)| {
            let fits = match cell(&table, l, r) {
                "." => false,
                result => cell(&assigned, l, result) != ".",
            };
            (format!("{l} {op}= {r};"), if fits { l } else { "." }.to_string())
        };
        let cases = pairs().into_iter().filter(|_| !matches!(*op, "<" | ">")).map(expected).collect();
        check(cases, "");
    }
}

#[test]
fn prefix_and_postfix_operators() {
    let rows = [
        ("-i -f -c -p -w -n -m -s -K -q -a", "i f c p w n m . K . ."),
        ("+i +f +c +p +w +n +m +s +K +q +a", "i f c p w n m s K q a"),
        ("~i ~f ~c ~p ~w ~n ~m ~s ~K ~q ~a", "i . . . . . . . . . ."),
        ("!i !f !c !p !w !n !m !s !K !q !a", "i i i i i i i i i . ."),
        ("++i ++f ++c ++p ++w ++n ++m ++s ++K ++q ++a", "i f c p w n m s . . ."),
        ("i-- f-- c-- p-- w-- n-- m-- s-- K-- q-- a--", "i f c p w n m s . . ."),
    ];
    for (expressions, types) in rows {
        let cases = expressions.split(' ').zip(types.split(' '));
        check(cases.map(|(e, ty)| (format!("{e};"), ty.to_string())).collect(), "");
    }
}

#[test]
fn the_ternary_operator() {
    let table = table(TERNARY);
    let expected = |(l, r)| (format!("i ? {l} : {r};"), cell(&table, l, r).to_string());
    check(pairs().into_iter().map(expected).collect(), "");
    let conditions = LETTERS.split(' ').zip("i i i i i i i i . . .".split(' '));
    check(conditions.map(|(l, ty)| (format!("{l} ? i : i;"), ty.to_string())).collect(), "");
}

#[test]
fn conditions_of_statements() {
    for (form, taken) in [
        ("if (@) ;", "i f c p w n m s K"),
        ("while (@) ;", "i f c p w n m s"),
        ("do ; while (@);", "i f c p w n m s"),
        ("for (; @; ) ;", "i f c p w n m s"),
    ] {
        let statements: Vec<String> = LETTERS.split(' ').map(|l| form.replace('@', l)).collect();
        for (verdict, letter) in judge("", &statements).iter().zip(LETTERS.split(' ')) {
            let takes = taken.split(' ').any(|t| t == letter);
            assert_eq!(verdict.is_error(), !takes, "{}: {:?}", form.replace('@', letter), verdict.codes);
        }
    }
}

const TYPES: &[(&str, &str)] = &[
    ("i", "int"),
    ("f", "float"),
    ("c", "color"),
    ("p", "point"),
    ("w", "vector"),
    ("n", "normal"),
    ("m", "matrix"),
    ("s", "string"),
    ("K", "closure color"),
    ("q", "S"),
];

/// The same conversions in assignments, initialisers, returns and arguments; the last two never convert a
/// float to an int.
#[test]
fn conversions() {
    let table = table(ASSIGNED);
    for (dst, name) in TYPES {
        let file = format!("{name} made; void take({name} x) {{}}").replace(&format!("{name} made; "), "");
        for src in LETTERS.split(' ') {
            let wanted = cell(&table, dst, src);
            let lossy = if wanted == "!" { vec!["W0202"] } else { Vec::new() };
            let assigned = judge(
                &file,
                &[
                    format!("{dst} = {src};"),
                    format!("{{ {name} x = {src}; }}"),
                    format!("{{ {name} give() {{ return {src}; }} give(); }}"),
                    format!("take({src});"),
                ],
            );
            for (at, verdict) in assigned.iter().enumerate() {
                let refused = wanted == "." || (wanted == "!" && at >= 2);
                assert_eq!(verdict.is_error(), refused, "{dst} from {src} at {at}: {:?}", verdict.codes);
                assert!(
                    refused || at >= 2 || verdict.codes == lossy,
                    "{dst} from {src}: {:?}",
                    verdict.codes
                );
            }
        }
    }
}

#[test]
fn arrays_structs_and_null_closures() {
    let file = "struct U { float x; };";
    let rows = [
        ("a = three;", false),
        ("three = a;", true),
        ("a = ints;", false),
        ("ints = a;", false),
        ("colors = points;", true),
        ("strings = a;", false),
        ("q = other;", false),
        ("q = q;", true),
        ("K = 0;", true),
        ("K = 0.0;", true),
        ("K = 0 + 0;", true),
        ("K = 1;", false),
        ("K = i;", false),
        ("K = c;", false),
        ("{ closure color give() { return 0; } give(); }", false),
        ("strings[0] = s;", true),
        ("colors[0] = 1;", true),
        ("c[0] = i;", true),
        ("c[0] = w;", false),
        ("m[0][1] = 2;", true),
        ("q.x = i;", true),
    ];
    let declared =
        "{ float three[3]; int ints[2]; color colors[2]; point points[2]; string strings[2]; @ }".to_string();
    let statements: Vec<String> = rows.iter().map(|(text, _)| declared.replace('@', text)).collect();
    for ((text, taken), verdict) in rows.iter().zip(judge(file, &statements)) {
        assert_eq!(verdict.is_error(), !taken, "{text}: {:?}", verdict.codes);
    }
}

#[test]
fn casts() {
    let table = table(CAST);
    for (ty, name) in TYPES.iter().filter(|(ty, _)| !matches!(*ty, "K" | "q")) {
        let expected = |l| (format!("({name}) {l};"), cell(&table, ty, l).to_string());
        check(LETTERS.split(' ').map(expected).collect(), "");
    }
}

#[test]
fn constructors_of_numbers_and_triples() {
    let numbers = "i f";
    let triples = "i f c p w n";
    for (ty, name, takes) in [
        ("i", "int", numbers),
        ("f", "float", numbers),
        ("c", "color", triples),
        ("p", "point", triples),
        ("w", "vector", triples),
        ("n", "normal", triples),
        ("m", "matrix", "i f m"),
    ] {
        let taken = |l| takes.split(' ').any(|t| t == l);
        let expected = |l| (format!("{name}({l});"), if taken(l) { ty } else { "." }.to_string());
        check(LETTERS.split(' ').map(expected).collect(), "");
    }
    for (ty, name) in TYPES.iter().filter(|(ty, _)| "cpwn".contains(ty)) {
        let rows = [
            (format!("{name}(i, f, 1);"), *ty),
            (format!("{name}(\"a\", i, f, 1);"), *ty),
            (format!("{name}(s, 1, 2, 3);"), *ty),
            (format!("{name}(concat(s, s), 1, 2, 3);"), *ty),
            (format!("{name}(1, 2);"), "."),
            (format!("{name}(1, 2, 3, 4);"), "."),
            (format!("{name}(c, 1, 2);"), "."),
            (format!("{name}(s, 1);"), "."),
            (format!("{name}(s, c);"), "."),
            (format!("{name}(1, s, 2, 3);"), "."),
            (format!("{name}(s);"), "."),
        ];
        check(rows.map(|(text, ty)| (text, ty.to_string())).to_vec(), "");
    }
}

#[test]
fn constructors_of_matrices_and_structs() {
    let sixteen = vec!["i"; 16].join(", ");
    let rows = [
        (format!("matrix({sixteen});"), "m"),
        (format!("matrix(s, {sixteen});"), "m"),
        (format!("matrix({sixteen}, f);"), "."),
        (format!("matrix(s, s, {sixteen});"), "."),
        ("matrix(s, f);".to_string(), "m"),
        ("matrix(s, 1);".to_string(), "m"),
        ("matrix(s, s);".to_string(), "m"),
        ("matrix(s);".to_string(), "."),
        ("matrix(s, m);".to_string(), "."),
        ("matrix(s, s, s);".to_string(), "."),
        ("matrix(i, f);".to_string(), "."),
        ("matrix(c, c, c, c);".to_string(), "."),
        ("int(f, f);".to_string(), "."),
        ("float(f, f);".to_string(), "."),
        ("S(f);".to_string(), "q"),
        ("S(i);".to_string(), "q"),
        ("S(c);".to_string(), "."),
        ("S(f, f);".to_string(), "."),
        ("S(s);".to_string(), "."),
    ];
    check(rows.map(|(text, ty)| (text, ty.to_string())).to_vec(), "");
}
