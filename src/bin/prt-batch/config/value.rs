//! Values of TOML as one would type them.

use clap::Arg;
use toml::de::DeValue;

/// What would be typed behind `arg`'s name for `value`: `Some(None)` for a switch that is on, `None` for one that is
/// off.
///
/// # Errors
/// The value is of a type that the option does not take; the text says which it takes.
pub fn typed(arg: &Arg, value: &DeValue<'_>) -> Result<Option<Option<String>>, String> {
    let takes_value = arg.get_action().takes_values();
    match value {
        DeValue::Boolean(on) if !takes_value => Ok(on.then_some(None)),
        _ if !takes_value => Err(format!("is a switch, but this is {}; allowed: true, false", kind(value))),
        DeValue::Array(list) if is_list(arg) => {
            let parts: Result<Vec<_>, _> = list.iter().map(|part| scalar(arg, part.get_ref())).collect();
            Ok(Some(Some(parts?.join(","))))
        }
        value => Ok(Some(Some(scalar(arg, value)?))),
    }
}

fn scalar(arg: &Arg, value: &DeValue<'_>) -> Result<String, String> {
    match value {
        DeValue::String(text) => Ok(text.to_string()),
        DeValue::Integer(number) if number.radix() == 10 => Ok(number.as_str().to_owned()),
        DeValue::Integer(number) => match u64::from_str_radix(number.as_str(), number.radix()) {
            Ok(decimal) => Ok(decimal.to_string()),
            Err(_) => Err("is too large a number".into()),
        },
        DeValue::Float(number) => Ok(number.as_str().to_owned()),
        other => {
            let value = arg.get_value_names().map(|names| names.join(" ")).unwrap_or_default();
            let list = if is_list(arg) { " or a list of numbers" } else { "" };
            Err(format!("is {}; allowed: {value}, as a string or a number{list}", kind(other)))
        }
    }
}

/// Whether the option's value is made of parts with commas between.
fn is_list(arg: &Arg) -> bool {
    let is_list = |name: &str| name.contains(',') || name == "LIST";
    arg.get_value_names().is_some_and(|names| names.iter().any(|name| is_list(name)))
}

fn kind(value: &DeValue<'_>) -> &'static str {
    match value {
        DeValue::String(_) => "a string",
        DeValue::Integer(_) | DeValue::Float(_) => "a number",
        DeValue::Boolean(_) => "true or false",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "a list",
        DeValue::Table(_) => "a table",
    }
}
