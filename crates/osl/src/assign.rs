//! Gives parameters their values: those of a layer before it is compiled, and live ones after.

use crate::Value;
use osl_hir::hir;
use osl_ir::ir::Const;
use osl_ir::types::Type;
use osl_lower::params::{self, ParamError, ParamValues};

/// Adds the value of a parameter, or of each field of a struct.
pub(crate) fn set_in(
    program: &hir::Program,
    values: &mut ParamValues,
    name: &str,
    value: &Value,
) -> Result<(), String> {
    if let Value::Struct(fields) = value {
        let mut field =
            |(field, value): &(String, Value)| set_in(program, values, &format!("{name}.{field}"), value);
        return fields.iter().try_for_each(&mut field);
    }
    let Some((ty, constants)) = value.constants() else {
        return Err(format!("parameter `{name}` takes no closures and no lists"));
    };
    let result = match params::set_constants(program, values, ty, name, constants) {
        Err(ParamError::Type { .. }) if let Value::Int(n) = value => {
            let float = vec![Const::Float(*n as f32)];
            params::set_constants(program, values, Type::FLOAT, name, float)
        }
        result => result,
    };
    result.map_err(|e| e.to_string())
}
