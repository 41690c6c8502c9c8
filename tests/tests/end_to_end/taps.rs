//! Taps have the values that an instrumented source prints, and leave the other outputs as they are.

use osl_tests::instrument::taps_hold;
use osl_tests::{generate, run};
use std::panic::catch_unwind;

/// Compares all sources; at least this many values.
fn hold(sources: impl Iterator<Item = (String, String)>, least: usize) {
    let (mut n, mut used, mut compared, mut broken) = (0, 0, 0, Vec::new());
    for (name, text) in sources {
        n += 1;
        match catch_unwind(|| taps_hold(&text)) {
            Ok(Ok(more)) => {
                used += usize::from(more.is_some());
                compared += more.unwrap_or(0);
            }
            Ok(Err(why)) => broken.push((name, why)),
            Err(_) => broken.push((name, "panics".to_string())),
        }
    }
    println!("{used} of {n} sources, {compared} values compared");
    for (name, why) in broken.iter().take(4) {
        println!("--- {name}: {}", why.chars().take(4000).collect::<String>());
    }
    assert!(broken.is_empty(), "{} of {n}", broken.len());
    assert!(compared >= least, "{compared} values are few");
}

fn text(seed: u64) -> String {
    generate::program(&generate::noise_bytes(seed, 200 + (seed % 7) as usize * 100))
}

#[test]
fn of_generated_programs() {
    hold((0..80).map(|seed| (seed.to_string(), text(seed))), 2000);
}

#[test]
fn of_the_seeds() {
    let seeds = ["Cobbled", "chaosmosaic", "flakes", "nonlinear_noise", "sprinkles", "strips"];
    let source = |name: &str| std::fs::read_to_string(run::root().join(format!("osl/{name}.osl"))).unwrap();
    hold(seeds.into_iter().map(|name| (name.to_string(), source(name))), 1000);
}

#[test]
fn of_jumps_loops_and_calls() {
    let text = "float twice(float x)
{
    float y = 2 * x;
    if (y > 1)
        return y;
    y += 1;
    return y;
}
struct pair { float a; color b; };
shader s(output float o = 0)
{
    pair p;
    p.a = u;
    p.b = color(u, v, 1);
    for (int i = 0; i < 5; i++)
    {
        if (i > 3 * u)
            break;
        if (i == 1)
            continue;
        p.a += twice(u * i);
        o = p.a;
    }
    if (v > 0.9)
        exit();
    o += twice(v);
}
";
    hold(std::iter::once(("own".to_string(), text.to_string())), 60);
}

/// Run it with `cargo test --release -p osl-tests --test end_to_end -- --ignored taps`.
#[test]
#[ignore = "takes minutes"]
fn of_many_programs() {
    hold((0..3000).map(|seed| (seed.to_string(), text(seed))), 50_000);
}
