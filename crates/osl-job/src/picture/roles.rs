//! Which outputs of a shader play which role in a preview: its base color, bumps, normal, roughness and
//! displacement.
//!
//! An option names the output of a role; a role without an option goes to an output whose name and type say
//! so.

use crate::Failure;
use crate::request::values::Gained;
use osl_hir::hir;
use osl_ir::ir::Body;
use osl_ir::types::{Base, StructTable, Type};
use osl_syntax::ast::ShaderKind;
use osl_syntax::spelling::closest;

/// The outputs that the command line names.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Asked<'a> {
    pub base: Option<&'a str>,
    pub bump: Option<&'a Gained>,
    pub normal: Option<&'a str>,
    pub roughness: Option<&'a str>,
    pub displace: Option<&'a Gained>,
}

/// The outputs for each role.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Roles {
    /// The closure of the shader that is shown. Then only a displacement has a role.
    pub closure: Option<String>,
    pub base: Option<String>,
    pub bump: Option<Gained>,
    pub normal: Option<String>,
    pub roughness: Option<String>,
    pub displace: Option<Gained>,
}

/// Names of outputs that are heights over the surface, or displace it.
const HEIGHTS: [&str; 4] = ["bump", "height", "displacement", "disp"];

impl Roles {
    /// The roles of the outputs of a shader. `body` has those that it makes without declaring them.
    pub(super) fn of(program: &hir::Program, body: &Body, asked: Asked<'_>) -> Result<Roles, Failure> {
        let makes = |name: &str| body.outputs.iter().any(|output| &*output.name == name);
        let moves = program.shader.kind == ShaderKind::Displacement && makes("P");
        let outputs = Outputs::of(program);
        // Without `Ci` and without values, a closure that is an output stands for the surface.
        let of_output = body.outputs.iter().find(|o| o.ty == Type::CLOSURE && outputs.list.is_empty());
        let closure = if makes("Ci") { Some("Ci") } else { of_output.map(|output| &*output.name) };
        let Asked { base, bump, normal, roughness, displace } = asked;
        let named = base.is_some() || bump.is_some() || normal.is_some() || roughness.is_some();
        let is_vector = |ty: Type| ty.is_triple() && ty != Type::COLOR;
        let mut roles = Roles { closure: closure.filter(|_| !named).map(str::to_string), ..Roles::default() };
        if let Some(Gained { name, gain }) = displace {
            let fits = |ty| ty == Type::FLOAT || is_vector(ty);
            if !(moves && name == "P") {
                outputs.check("displace", "a displacement is a float, a vector or a point", name, fits)?;
            }
            roles.displace = Some(Gained { name: name.clone(), gain: *gain });
        } else if moves {
            roles.displace = Some(Gained { name: "P".to_string(), gain: 1.0 });
        } else {
            let by = |name: &str, ty| (ty == Type::VECTOR && is_height(name)).then_some(());
            roles.displace = outputs.first(by).map(|name| Gained { name, gain: 1.0 });
        }
        if roles.closure.is_some() {
            return Ok(roles);
        }
        let is_color = |ty: Type| ty.is_triple() || matches!(ty, Type::FLOAT | Type::INT);
        roles.base = base
            .map(|name| outputs.check("base", "a base color is a color or a number", name, is_color))
            .transpose()?;
        roles.normal = normal
            .map(|name| {
                outputs
                    .check("normal", "a normal is a normal, a vector or a color", name, |ty| ty.is_triple())
            })
            .transpose()?;
        roles.roughness = roughness
            .map(|name| outputs.check("roughness", "a roughness is a float", name, |ty| ty == Type::FLOAT))
            .transpose()?;
        if let Some(Gained { name, gain }) = bump {
            let name =
                outputs.check("bump", "a bump is a float, its height", name, |ty| ty == Type::FLOAT)?;
            roles.bump = Some(Gained { name, gain: *gain });
        }
        roles.recognise(&outputs);
        Ok(roles)
    }

    /// Gives roles without an output to outputs that have none.
    fn recognise(&mut self, outputs: &Outputs) {
        let displaced = self.displace.as_ref().map(|output| output.name.clone());
        let is_free = |name: &str| displaced.as_deref() != Some(name);
        let pick = |fits: &dyn Fn(&str, Type) -> bool| {
            outputs.first(|name, ty| (is_free(name) && fits(name, ty)).then_some(()))
        };
        if self.normal.is_none() {
            self.normal = pick(&|_, ty| ty == Type::NORMAL);
        }
        if self.roughness.is_none() {
            self.roughness = pick(&|name, ty| ty == Type::FLOAT && name.to_lowercase().contains("rough"));
        }
        if self.bump.is_none() && displaced.is_none() {
            let found = pick(&|name, ty| ty == Type::FLOAT && is_height(name));
            self.bump = found.map(|name| Gained { name, gain: 1.0 });
        }
        if self.base.is_none() {
            let bump = self.bump.as_ref().map(|output| output.name.as_str());
            let taken = [bump, self.normal.as_deref(), self.roughness.as_deref()];
            let is_left = |name: &str| !taken.contains(&Some(name));
            self.base = pick(&|name, ty| ty == Type::COLOR && is_left(name))
                .or_else(|| pick(&|name, ty| matches!(ty, Type::FLOAT | Type::INT) && is_left(name)))
                .or_else(|| pick(&|name, ty| ty.is_triple() && is_left(name)));
        }
    }

    /// Which outputs play which role, in words.
    pub(super) fn words(&self) -> String {
        let gained = |output: &Gained| match output.gain {
            1.0 => format!("`{}`", output.name),
            gain => format!("`{}` times {gain}", output.name),
        };
        let plain = |name: &String| format!("`{name}`");
        let roles = [
            ("the closure", self.closure.as_ref().map(plain)),
            ("base color", self.base.as_ref().map(plain)),
            ("bump", self.bump.as_ref().map(gained)),
            ("normal", self.normal.as_ref().map(plain)),
            ("roughness", self.roughness.as_ref().map(plain)),
            ("displacement", self.displace.as_ref().map(gained)),
        ];
        let list: Vec<String> =
            roles.into_iter().filter_map(|(role, name)| Some(format!("{role} {}", name?))).collect();
        if list.is_empty() { "a plain surface".to_string() } else { list.join(", ") }
    }
}

/// Whether an output with this name is a height or a displacement: `height`, `resultBump`, `out_disp`.
fn is_height(name: &str) -> bool {
    let name = name.to_lowercase();
    let own =
        ["result", "out", "output"].iter().find_map(|before| name.strip_prefix(before)).unwrap_or(&name);
    HEIGHTS.contains(&own.trim_matches('_'))
}

/// The outputs of a shader: names and types, without arrays and structs.
struct Outputs {
    list: Vec<(String, Type)>,
}

impl Outputs {
    fn of(program: &hir::Program) -> Outputs {
        let outputs = program.shader.params.iter().filter(|param| param.output);
        let vars = outputs.filter_map(|param| program.vars.get(param.var.0 as usize));
        let is_plain = |ty: Type| !ty.is_array() && ty.as_struct().is_none();
        let shown =
            vars.filter(|var| is_plain(var.ty) && !matches!(var.ty.base, Base::String | Base::Closure));
        Outputs { list: shown.map(|var| (var.name.to_string(), var.ty)).collect() }
    }

    /// The first output that suits.
    fn first(&self, suits: impl Fn(&str, Type) -> Option<()>) -> Option<String> {
        self.list.iter().find(|(name, ty)| suits(name, *ty).is_some()).map(|(name, _)| name.clone())
    }

    /// The output that an option names, if it suits the role.
    fn check(
        &self,
        option: &str,
        role: &str,
        name: &str,
        suits: impl Fn(Type) -> bool,
    ) -> Result<String, Failure> {
        let suitable = || {
            let names = self.list.iter().filter(|(_, ty)| suits(*ty)).map(|(name, _)| name.as_str());
            match names.collect::<Vec<_>>() {
                names if names.is_empty() => "the shader has no such output".to_string(),
                names => format!("suitable: {}", names.join(", ")),
            }
        };
        match self.list.iter().find(|(known, _)| known == name) {
            Some((_, ty)) if suits(*ty) => Ok(name.to_string()),
            Some((_, ty)) => {
                let ty = StructTable::default().show(*ty);
                Err(Failure::new(format!(
                    "--{option}: output `{name}` is a {ty}, but {role}; {}",
                    suitable()
                )))
            }
            None => {
                let close = closest(name, self.list.iter().map(|(name, _)| name.as_str()));
                let close = close.map_or_else(String::new, |name| format!("; did you mean `{name}`?"));
                Err(Failure::new(format!(
                    "--{option}: the shader has no output `{name}`{close} ({})",
                    suitable()
                )))
            }
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test says what must hold")]
mod tests {
    use super::*;
    use osl::stages::{self, NoFiles, Options};

    fn roles(text: &str, asked: Asked<'_>) -> Result<Roles, String> {
        let checked = stages::check("a.osl", text, &NoFiles, &Options::default());
        let program = checked.program.unwrap();
        let body = stages::lower(&program, &[]).unwrap();
        Roles::of(&program, &body, asked).map_err(|failure| failure.text)
    }

    const ALL: &str = "shader a(output float mask = 0, output color tint = 0, output float Height = 0,
        output float specRoughness = 0, output normal bent = 0, output vector disp = 0, output string s = \"\") {}";

    #[test]
    fn roles_are_recognised_by_name_and_type() {
        let found = roles(ALL, Asked::default()).unwrap();
        assert_eq!(
            found.words(),
            "base color `tint`, normal `bent`, roughness `specRoughness`, displacement `disp`"
        );
        let found = roles("shader a(output float bump = 0, output float far = 0) {}", Asked::default());
        assert_eq!(found.unwrap().words(), "base color `far`, bump `bump`");
        let found = roles("shader a(output point UV = 0) {}", Asked::default()).unwrap();
        assert_eq!(found.words(), "base color `UV`");
        assert_eq!(roles("shader a() {}", Asked::default()).unwrap().words(), "a plain surface");
        let found = roles("displacement a() { P += N; }", Asked::default()).unwrap();
        assert_eq!(found.words(), "displacement `P`");
        let found = roles("displacement a(output vector disp = 0) { disp = N; }", Asked::default()).unwrap();
        assert_eq!(found.words(), "displacement `disp`");
        let found = roles("surface a(output color c = 0) { Ci = c * diffuse(N); }", Asked::default());
        assert_eq!(found.unwrap().words(), "the closure `Ci`");
        let found = roles("surface a(output closure color out = 0) { out = diffuse(N); }", Asked::default());
        assert_eq!(found.unwrap().words(), "the closure `out`");
    }

    #[test]
    fn options_choose_and_are_checked() {
        let half = Gained { name: "Height".to_string(), gain: 0.5 };
        let asked = Asked { base: Some("mask"), displace: Some(&half), ..Asked::default() };
        let found = roles(ALL, asked).unwrap();
        assert_eq!(
            found.words(),
            "base color `mask`, normal `bent`, roughness `specRoughness`, displacement `Height` times 0.5"
        );
        let asked = Asked { base: Some("tnt"), ..Asked::default() };
        assert_eq!(
            roles(ALL, asked).unwrap_err(),
            "--base: the shader has no output `tnt`; did you mean `tint`? (suitable: mask, tint, Height, specRoughness, \
             bent, disp)"
        );
        let asked = Asked { roughness: Some("tint"), ..Asked::default() };
        assert_eq!(
            roles(ALL, asked).unwrap_err(),
            "--roughness: output `tint` is a color, but a roughness is a float; suitable: mask, Height, specRoughness"
        );
    }
}
