//! Points: values that stay the same, data with names, and the order of an image change no bits.

#![allow(clippy::unwrap_used, missing_docs, reason = "a test says what must hold")]

use osl::{Column, CompileOptions, Group, Points, Program, Renderer, RunOptions, Shader, Tile};
use std::sync::Mutex;

const TEXT: &str = "
    shader s(float k = 1, float list[2] = {0, 0}, output float o = 0, output color c = 0, output int i = 0) {
        float s = 0;
        getattribute(\"s\", s);
        o = k * u + noise(P * 20) + s + list[1];
        c = color(N[0], I[2], Ng[1]) * time + Dx(P) + calculatenormal(P);
        i = (int)(v * 1000);
        if (u > 0.99) printf(\"%g \", floor(P[1] * 1000));
    }";

fn program(points: &Points<'_>) -> Program {
    let shader = Shader::compile("s.osl", TEXT).unwrap();
    let group = Group::new().layer("s", &shader).interpolate("k").interpolate("list");
    group.compile_with(&CompileOptions::default().points(points)).unwrap()
}

fn image<'a>(width: usize, height: usize) -> Points<'a> {
    let at = |axis: fn(usize, usize) -> usize, n: usize| -> Vec<f32> {
        (0..width * height).map(|i| axis(i, width) as f32 / n as f32).collect()
    };
    let (u, v) = (at(|i, w| i % w, width), at(|i, w| i / w, height));
    let p: Vec<[f32; 3]> = u.iter().zip(&v).map(|(u, v)| [*u, *v, 1.0]).collect();
    let k: Vec<f32> = (0..width * height).map(|i| i as f32).collect();
    let points = Points::new(width * height).u(u.clone()).v(v).p(p);
    let points = points.p_derivs(vec![[0.1, 0.0, 0.0]; k.len()], vec![[0.0, 0.2, 0.0]; k.len()]);
    let list = k.iter().flat_map(|k| [0.0, 2.0 * k]).collect::<Vec<f32>>();
    let points = points.data("list", Column::Arrays(Box::new(list.into()), 2));
    points.data("k", k).data("s", u)
}

/// The words of all columns, and what the shader prints, by tiles.
fn by_tiles(program: &Program, points: &Points<'_>) -> (Vec<Vec<u32>>, String) {
    let columns = program.columns().unwrap();
    let all = Mutex::new(vec![vec![7_u32; points.count()]; columns.len()]);
    let take = |tile: Tile<'_>| {
        let mut all = all.lock().unwrap();
        for (first, words) in tile.pieces() {
            for (to, from) in all.iter_mut().zip(tile.words) {
                to[first..first + words.len()].copy_from_slice(&from[words.clone()]);
            }
        }
    };
    let out = program.run_tiles(points, &Renderer::default(), &RunOptions::default(), &take).unwrap();
    (all.into_inner().unwrap(), out.printed())
}

#[test]
fn the_order_of_an_image_changes_nothing() {
    for (width, height) in [(1, 1), (5, 3), (32, 32), (33, 70), (200, 90), (9000, 2), (0, 0)] {
        let points = image(width, height).everywhere("time", [0.5, 0.0, 0.0]).unwrap();
        let program = program(&points);
        let expected = by_tiles(&program, &points);
        assert_eq!(by_tiles(&program, &points.clone().row(width)), expected, "{width} by {height}");
        let whole = program.run(&points.row(width)).unwrap();
        let bits = |values: &[f32]| values.iter().map(|x| x.to_bits()).collect::<Vec<u32>>();
        assert_eq!(whole.component("o", 0).map(bits), Some(expected.0[0].clone()));
        assert_eq!(whole.component("c", 2).map(bits), Some(expected.0[3].clone()));
        assert_eq!(whole.printed(), expected.1);
    }
}

#[test]
fn values_that_stay_the_same_are_those_of_lists() {
    let n = [0.0, 0.6, 0.8];
    let listed = || image(40, 30).n(vec![n; 1200]).i(vec![[1.0, 2.0, 3.0]; 1200]).time(vec![0.5; 1200]);
    let same = |points: Points<'static>| {
        let points = points.everywhere("N", n).unwrap().everywhere("I", [1.0, 2.0, 3.0]).unwrap();
        points.everywhere("time", [0.5, 0.0, 0.0]).unwrap()
    };
    let expected = by_tiles(&program(&listed()), &listed());
    assert_eq!(by_tiles(&program(&same(image(40, 30))), &same(image(40, 30))), expected);
    // A list takes precedence, and a normal of its own is kept.
    assert_eq!(by_tiles(&program(&same(listed())), &same(listed())), expected);
    let own = |points: Points<'static>| points.everywhere("Ng", [0.0, 9.0, 0.0]).unwrap();
    let expected = by_tiles(&program(&own(same(image(40, 30)))), &own(same(image(40, 30))));
    assert_eq!(by_tiles(&program(&own(listed())), &own(listed())), expected);
    assert!(Points::new(1).everywhere("nothing", n).is_err());
    assert!(Points::new(1).everywhere("Ci", n).is_err());
}

#[test]
fn data_must_fit() {
    let points = image(40, 30);
    let program = program(&points);
    for data in [vec![0.0_f32; 7].into(), Column::Arrays(Box::new(vec![0; 1200].into()), 2)] {
        assert!(program.run(&points.clone().data("k", data)).is_err());
    }
    // Values of another type are ignored, as for attributes.
    let other = Points::new(2).u(vec![0.1, 0.2]).data_everywhere("k", "x").data("s", vec![3, 4]);
    let plain = Points::new(2).u(vec![0.1, 0.2]);
    let program = self::program(&other);
    assert_eq!(program.run(&other).unwrap().floats("o"), program.run(&plain).unwrap().floats("o"));
    let same = plain.data_everywhere("k", 3.0).data_everywhere("s", 1.0);
    let listed = Points::new(2).u(vec![0.1, 0.2]).data("k", vec![3.0_f32; 2]).data("s", vec![1.0_f32; 2]);
    assert_eq!(program.run(&same).unwrap().floats("o"), program.run(&listed).unwrap().floats("o"));
}

/// Services that know one space.
struct Spaces(bool);

impl osl::RendererServices for Spaces {
    fn transform(&self, space: &str) -> Option<[f32; 16]> {
        let shift = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 5.0, 0.0, 0.0, 1.0];
        (self.0 && space == "shader").then_some(shift)
    }

    fn has_spaces(&self) -> bool {
        self.0
    }
}

#[test]
fn spaces_that_are_known_change_nothing() {
    let text = "shader s(output point o = 0, output float d = 0) { o = transform(\"shader\", P); vector w = Dx(o); d = w[0]; }";
    let group = || Group::new().layer("s", &Shader::compile("s.osl", text).unwrap());
    let points = image(50, 20);
    let without = Renderer::new(Spaces(false));
    let compiled = |options: CompileOptions| group().compile_with(&options.points(&points)).unwrap();
    let (usual, known) =
        (compiled(CompileOptions::default()), compiled(CompileOptions::default().renderer(&without)));
    let run = |program: &Program, renderer: &Renderer| {
        program.run_with(&points, renderer, &RunOptions::default()).map(|out| out.triples("o").unwrap())
    };
    assert_eq!(run(&known, &without), run(&usual, &without));
    assert_eq!(run(&known, &without.answering(Spaces(false))), run(&usual, &Renderer::default()));
    assert_eq!(
        run(&usual, &without.answering(Spaces(true))).unwrap()[7][0],
        run(&known, &without).unwrap()[7][0] - 5.0
    );
    assert!(run(&known, &Renderer::new(Spaces(true))).is_err());
}
