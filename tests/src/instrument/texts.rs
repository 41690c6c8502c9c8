//! The text of an explanation against its JSON: each value of the one is in the other.

use osl_measure::explain::Explanation;
use osl_measure::explain::text::{self, Style};
use serde_json::Value;

/// Six digits, rounded.
const ROUNDING: f64 = 5.1e-6;

/// Compares the variables of all lines that run in one call, the globals, the outputs and the reports;
/// returns how many values were compared.
pub(super) fn hold(explanation: &Explanation) -> Result<usize, String> {
    let json = serde_json::to_value(explanation).map_err(|error| error.to_string())?;
    let text = text::text(explanation, "a point", Style { exact: false, all: true });
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let mut compared = 0;
    let mut rest = text.as_str();
    for line in list(&json["lines"]) {
        let number = line["number"].as_u64().unwrap_or_default();
        let head = format!("{number} | ");
        let starts = rest.match_indices(&head).map(|(at, _)| at);
        let is_head = |at: &usize| rest[..*at].trim_end_matches(' ').ends_with('\n');
        let Some(block) = starts.filter(is_head).map(|at| &rest[at..]).next() else {
            return Err(format!("line {number} is not in the text\n{text}"));
        };
        rest = block;
        let told: Vec<&str> =
            block.lines().skip(1).map_while(|l| Some(l.trim_start().strip_prefix(':')?.trim())).collect();
        let because = |law: String| format!("{law}\n{line:#}\n{}", told.join("\n"));
        for report in list(&line["reports"]) {
            let first = report["message"].as_str().and_then(|text| text.lines().next()).unwrap_or_default();
            let said = told.iter().any(|text| text.starts_with("error: ") && text.contains(first.trim()));
            if !said && first.chars().all(|c| !c.is_control()) {
                return Err(because(format!("`{first}` is not in the text")));
            }
            compared += 1;
        }
        if list(&line["calls"]).len() != 1 {
            continue;
        }
        let sets: Vec<Value> =
            list(&line["facts"]).into_iter().filter(|fact| fact["fact"] == "set").collect();
        let quiet = line["state"] == "not_needed";
        let mut said: Vec<&str> = told.iter().filter(|text| set_name(text).is_some()).copied().collect();
        for fact in &sets {
            let name = fact["name"].as_str().unwrap_or_default();
            let head = if name == "return" { "returns ".to_string() } else { format!("{name} = ") };
            let Some(at) = said.iter().position(|text| text.starts_with(&head)) else {
                return Err(because(format!("`{name}` is not in the text")));
            };
            let text = said.remove(at)[head.len()..].to_string();
            let text = if quiet { text } else { without_status(&text, fact).map_err(because)? };
            compared += values(&text, &list(&fact["values"])).map_err(because)?;
        }
        if let Some(more) = said.first() {
            return Err(because(format!("`{more}` is not in the JSON")));
        }
    }
    for (list_of, head) in [("globals", "  "), ("outputs", "")] {
        for named in list(&json[list_of]) {
            let start = format!("\n{head}{} = ", named[0].as_str().unwrap_or_default());
            let Some((_, after)) = text.rsplit_once(&start) else {
                return Err(format!("{start} in\n{text}"));
            };
            let shown = after.lines().next().unwrap_or_default();
            compared +=
                values(shown, std::slice::from_ref(&named[1])).map_err(|law| format!("{start}{law}"))?;
        }
    }
    Ok(compared)
}

/// The variable of a sentence that gives values.
fn set_name(text: &str) -> Option<&str> {
    if text.starts_with("returns ") {
        return Some("return");
    }
    let (name, _) = text.split_once(" = ")?;
    let is_name = |c: char| c.is_alphanumeric() || "_.[]".contains(c);
    name.chars().all(is_name).then_some(name)
}

/// Removes what the sentence says about the compiler, which must be what the JSON says.
fn without_status(text: &str, fact: &Value) -> Result<String, String> {
    let words = |compiled: &Value| match compiled {
        Value::String(word) => match &word[..] {
            "not_needed" => "not needed".to_string(),
            "constant" => "known when the shader is compiled".to_string(),
            _ => String::new(),
        },
        other => format!("line {} computes the same", other["same_as_line"]),
    };
    let Some(each) = fact["each"].as_array() else {
        return match words(&fact["compiled"]) {
            words if words.is_empty() => Ok(text.to_string()),
            words => {
                let status = format!(" ({words})");
                text.strip_suffix(&status).map(str::to_string).ok_or(format!("no `{status}` in `{text}`"))
            }
        };
    };
    let (values, status) = text.rsplit_once(" (value").ok_or(format!("no status of values in `{text}`"))?;
    if status.contains('…') {
        return Ok(values.to_string());
    }
    let mut of_text = vec![String::new(); each.len()];
    for part in status.trim_end_matches(')').split("; ") {
        let part =
            part.trim_start_matches("values ").trim_start_matches("value ").trim_start_matches('s').trim();
        let at = part.find(|c: char| c.is_alphabetic() && c != 't' && c != 'o').unwrap_or(part.len());
        let (numbers, words) = part.split_at(at);
        for run in numbers.trim().split(", ") {
            let (start, end) = run.split_once(" to ").unwrap_or((run, run));
            let (Ok(start), Ok(end)) = (start.trim().parse::<usize>(), end.trim().parse::<usize>()) else {
                return Err(format!("`{run}` in `{text}`"));
            };
            of_text.iter_mut().take(end).skip(start - 1).for_each(|own| *own = words.to_string());
        }
    }
    match of_text == each.iter().map(words).collect::<Vec<String>>() {
        true => Ok(values.to_string()),
        false => Err(format!("`{status}` is not {each:?}")),
    }
}

/// Compares values of the text with those of the JSON.
fn values(text: &str, json: &[Value]) -> Result<usize, String> {
    let is_number = |text: &str| text.parse::<f64>().is_ok_and(|x| !x.is_finite());
    let is_text = |value: &Value| {
        value["closure"] == true
            || value["value"].as_str().is_some_and(|own| !is_number(own) || text.contains('"'))
    };
    if json.iter().any(is_text) {
        // A string or a closure may contain anything: only whole values are compared.
        let whole = |value: &Value| match (&value["value"], value["closure"] == true) {
            (Value::String(text), true) => text.clone(),
            (Value::String(text), false) => format!("{text:?}"),
            _ => String::new(),
        };
        let is_said =
            |value: &Value| text.contains(&whole(value)) || text.ends_with('…') || text.contains("\"…");
        return match json.iter().all(is_said) {
            true => Ok(json.len()),
            false => Err(format!("`{text}` is not {json:?}")),
        };
    }
    let mut said: Vec<&str> = text.split(", ").collect();
    if let [one, times] = said[..]
        && times == format!("{} times", json.len())
    {
        said = vec![one; json.len()];
    }
    if said.len() != json.len() {
        return Err(format!("{} values in `{text}`, and {} in the JSON", said.len(), json.len()));
    }
    for (said, value) in said.iter().zip(json) {
        let words = said.trim_matches(['(', ')', '[', ']']).split(' ');
        let said: Vec<Option<f64>> = words.map(|word| word.parse().ok()).collect();
        let value = &value["value"];
        let numbers = match value {
            Value::Array(list) => list.iter().map(number).collect(),
            one => vec![number(one)],
        };
        let is_close = |(a, b): (&Option<f64>, &Option<f64>)| match (a, b) {
            (Some(a), Some(b)) => a == b || (a.is_nan() && b.is_nan()) || (a - b).abs() <= ROUNDING * b.abs(),
            (a, b) => a.is_none() && b.is_none(),
        };
        if said.len() != numbers.len() || !said.iter().zip(&numbers).all(is_close) {
            return Err(format!("`{text}`: {said:?} is not {value}"));
        }
    }
    Ok(json.len())
}

/// A number of the JSON; NaN and infinities are texts there.
fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Number(n) => n.as_f64(),
        Value::String(text) => text.parse().ok(),
        _ => None,
    }
}
