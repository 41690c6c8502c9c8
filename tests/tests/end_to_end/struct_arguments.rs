//! Structs, arrays and their members as arguments: what a formal refers to, what is copied, and what is
//! written back.

use osl_tests::ways;

/// Structs of every form that may be nested, and functions that each write one argument.
const HEAD: &str = "
struct Leaf { float f; int i; };
struct Row { Leaf leaf[3]; float len; };
struct Nums { float x[3]; color c; };
struct Top { Row row; Leaf one; Nums nums; };
void set(output Leaf l) { l.f = 6; l.i = 7; }
void set_float(output float f) { f = 8; }
void set_color(output color c) { c = color(1, 2, 3); }
void set_row(output Row r) { r.leaf[0].i = 10; r.leaf[2].f = 11; r.len = 12; }
void set_list(output Leaf l[3]) { for (int k = 0; k < 3; ++k) { l[k].i = 20 + k; l[k].f = k; } }
void set_open(output Leaf l[]) { for (int k = 0; k < arraylength(l); ++k) { l[k].i = 30 + k; l[k].f = k; } }
void set_nums(output float x[]) { for (int k = 0; k < arraylength(x); ++k) x[k] = 40 + k; }
int total(Leaf l[]) { int s = 0; for (int k = 0; k < arraylength(l); ++k) s += l[k].i; return s; }
Leaf leaf(int k) { return Leaf(k, k); }
void clear(output Row r) { for (int k = 0; k < 3; ++k) { r.leaf[k].i = k; r.leaf[k].f = -k; } r.len = 3; }
void show(Row r) { printf(\"%d %d %d %g %g %g %g\", r.leaf[0].i, r.leaf[1].i, r.leaf[2].i, r.leaf[0].f, r.leaf[1].f, r.leaf[2].f, r.len); }
";

/// Checks the text that a shader with this body prints.
fn prints(functions: &str, body: &str, expected: &str) {
    ways::prints(&format!("{HEAD}{functions}\nshader s() {{\n{body}\n}}"), expected);
}

#[test]
fn a_member_without_an_index_is_the_formal() {
    for (body, expected) in [
        ("Leaf l = {1, 2}; set(l); printf(\"%g %d\", l.f, l.i);", "6 7"),
        ("Top t; t.one = Leaf(1, 2); set(t.one); printf(\"%g %d\", t.one.f, t.one.i);", "6 7"),
        ("Top t; t.one = Leaf(1, 2); set_float(t.one.f); printf(\"%g %d\", t.one.f, t.one.i);", "8 2"),
        ("Top t; t.nums.c = 5; set_color(t.nums.c); printf(\"%g\", t.nums.c);", "1 2 3"),
        ("Row r; clear(r); show(r);", "0 1 2 0 -1 -2 3"),
        ("Row r; clear(r); set_row(r); show(r);", "10 1 2 0 -1 11 12"),
        ("Top t; clear(t.row); set_row(t.row); show(t.row);", "10 1 2 0 -1 11 12"),
        ("Row r; clear(r); set_list(r.leaf); show(r);", "20 21 22 0 1 2 3"),
        ("Row r; clear(r); set_open(r.leaf); show(r);", "30 31 32 0 1 2 3"),
        ("Top t; clear(t.row); set_list(t.row.leaf); show(t.row);", "20 21 22 0 1 2 3"),
        ("Top t; clear(t.row); set_open(t.row.leaf); show(t.row);", "30 31 32 0 1 2 3"),
        ("Nums n; set_nums(n.x); printf(\"%g\", n.x);", "40 41 42"),
        ("Top t; set_nums(t.nums.x); printf(\"%g\", t.nums.x);", "40 41 42"),
        ("Top t; clear(t.row); set_open(t.row.leaf); printf(\"%d\", total(t.row.leaf));", "93"),
    ] {
        prints("", body, expected);
    }
}

#[test]
fn elements_and_components_are_written_back_but_not_elements_of_arrays_of_structs() {
    for (body, expected) in [
        ("Row r; clear(r); set(r.leaf[1]); show(r);", "0 1 2 0 -1 -2 3"),
        ("Top t; clear(t.row); set(t.row.leaf[2]); show(t.row);", "0 1 2 0 -1 -2 3"),
        ("Leaf l[2]; l[1].i = 4; set(l[1]); printf(\"%d %g\", l[1].i, l[1].f);", "4 0"),
        ("Row r; clear(r); set_float(r.leaf[1].f); show(r);", "0 1 2 0 8 -2 3"),
        ("Nums n; n.c = 5; set_float(n.c.g); printf(\"%g\", n.c);", "5 8 5"),
        ("Nums n; n.c = 5; set_float(n.c[2]); printf(\"%g\", n.c);", "5 5 8"),
        (
            "Top t; t.nums.x[0] = 1; t.nums.x[1] = 2; set_float(t.nums.x[1]); printf(\"%g\", t.nums.x);",
            "1 8 0",
        ),
        ("int k = 0; Top t; set_float(t.nums.x[k++]); printf(\"%g %d\", t.nums.x, k);", "8 0 0 1"),
    ] {
        prints("", body, expected);
    }
}

#[test]
fn formals_are_passed_on() {
    for (functions, body, expected) in [
        (
            "void on(output Top t) { set(t.one); t.one.f += 1; set_open(t.row.leaf); set_nums(t.nums.x); }",
            "Top t; on(t); printf(\"%g %d %g \", t.one.f, t.one.i, t.nums.x); show(t.row);",
            "7 7 40 41 42 30 31 32 0 1 2 0",
        ),
        (
            "void inner(output Leaf l[]) { set_open(l); l[0].i += arraylength(l); } void outer(output Row r) { inner(r.leaf); }",
            "Top t; outer(t.row); show(t.row);",
            "33 31 32 0 1 2 0",
        ),
        (
            "void sized(output Leaf l[3]) { set_open(l); } void open(output Leaf l[]) { sized(l); }",
            "Leaf l[3]; open(l); printf(\"%d\", total(l));",
            "93",
        ),
        (
            "void first(output Leaf l[]) { set(l[0]); l[1] = leaf(5); }",
            "Leaf l[2]; first(l); printf(\"%d %d %g\", l[0].i, l[1].i, l[1].f);",
            "0 5 5",
        ),
        ("float get(Leaf l) { return l.f + l.i; }", "printf(\"%g\", get(leaf(4)) + get({1, 2}));", "11"),
        (
            "void make(output Leaf l, int k) { l = leaf(k); }",
            "Top t; make(t.one, 3); printf(\"%d\", t.one.i);",
            "3",
        ),
    ] {
        prints(functions, body, expected);
    }
}

#[test]
fn two_formals_may_stand_for_one_variable() {
    for (functions, body, expected) in [
        (
            "void both(output Leaf a, output Leaf b) { a.f = 1; b.f += 1; a.i = b.f; }",
            "Top t; both(t.one, t.one); printf(\"%g %d\", t.one.f, t.one.i);",
            "2 2",
        ),
        (
            "float part(output Top t, output float f) { f = 3; return t.one.f; }",
            "Top t; printf(\"%g\", part(t, t.one.f));",
            "3",
        ),
        (
            "void part(output Leaf l, output Row r) { l.f = 5; }",
            "Row r; clear(r); part(r.leaf[1], r); show(r);",
            "0 1 2 0 -1 -2 3",
        ),
        (
            "int seen(Leaf l[], output Row r) { r.leaf[1].i = 50; return l[1].i; }",
            "Row r; clear(r); printf(\"%d\", seen(r.leaf, r));",
            "50",
        ),
        (
            "void add(output float a, output float b) { a = 1; b = 2; }",
            "Nums n; add(n.x[1], n.x[1]); printf(\"%g\", n.x[1]);",
            "2",
        ),
        // A formal that is not an output refers to the variable too.
        ("void write(Leaf l) { l.i = 9; }", "Top t; write(t.one); printf(\"%d\", t.one.i);", "9"),
        ("void write(float x[]) { x[2] = 9; }", "Top t; write(t.nums.x); printf(\"%g\", t.nums.x);", "0 0 9"),
        ("void write(Leaf l) { l.i = 9; }", "Leaf l[2]; write(l[1]); printf(\"%d\", l[1].i);", "0"),
    ] {
        prints(functions, body, expected);
    }
}

#[test]
fn functions_see_the_variables_around_them() {
    prints(
        "",
        "Top t; float part(output float f) { f = 3; return t.one.f; } printf(\"%g\", part(t.one.f));",
        "3",
    );
    prints(
        "",
        "Row r; clear(r); int part(output Leaf l) { l.i = 3; return r.leaf[1].i; } printf(\"%d\", part(r.leaf[1]));",
        "1",
    );
}

#[test]
fn the_length_of_an_array_of_structs() {
    for (body, expected) in [
        ("Leaf l[4]; printf(\"%d\", arraylength(l));", "4"),
        ("Top t; printf(\"%d %d\", arraylength(t.row.leaf), arraylength(t.nums.x));", "3 3"),
        (
            "int len(Leaf l[]) { return arraylength(l); } Leaf l[5]; Row r; printf(\"%d %d\", len(l), len(r.leaf));",
            "5 3",
        ),
        ("int len(Nums n) { return arraylength(n.x); } Top t; printf(\"%d\", len(t.nums));", "3"),
        ("int len(Row r) { return arraylength(r.leaf); } Top t; printf(\"%d\", len(t.row));", "3"),
    ] {
        prints("", body, expected);
    }
}
