//! Recordings of motors turned from outside with open terminals: speed and voltage.

use crate::dialect::{decode, without_hint};
use crate::error::{Error, Place, printable};
use crate::header::{list, normalise};
use crate::log::objection;
use crate::quantity::Quantity;
use crate::sheet::{Sheet, number};
use idim_model::JointKind;

/// What was recorded of one motor.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BackEmf {
    /// Its name; `motor` where the file has no column of names.
    pub motor: String,
    /// Speeds of the motor, rad/s.
    pub speed: Vec<f64>,
    /// Voltages at the open terminals, V.
    pub voltage: Vec<f64>,
}

/// Units of a voltage, V a unit.
const VOLTAGE: [(&str, f64); 3] = [("v", 1.0), ("mv", 1e-3), ("kv", 1e3)];

/// A column of numbers, and the factor to SI.
struct Column {
    at: usize,
    factor: f64,
    declared: bool,
}

/// Reads speeds and voltages of each motor, in the order the motors appear, from the bytes of a CSV file in any dialect
/// that a log may have, and what was assumed, one sentence each.
///
/// Columns are `speed` (rad/s, or with a unit as `speed_rpm`), `voltage` (V, or `voltage_mV`) and, where there are several
/// motors, `motor`. `file` names the file in messages.
///
/// # Errors
/// A column missing, doubled or in an unknown unit, a cell that is not a finite number, with its line.
pub fn read_back_emf(bytes: &[u8], file: &str) -> Result<(Vec<BackEmf>, Vec<String>), Error> {
    let text = without_hint(decode(bytes, file)?);
    let mut sheet = Sheet::open(&text, file)?;
    let headers = sheet.headers.clone();
    let dialect = sheet.dialect;
    let speed_unit = |unit: &str| Quantity::Velocity.factor(JointKind::Revolute, unit);
    let voltage_unit = |unit: &str| {
        let unit = unit.to_lowercase();
        VOLTAGE.iter().find(|u| u.0 == unit).map(|u| u.1)
    };
    let speed = column(
        &headers,
        "speed",
        speed_unit,
        "rad_s, deg_s, rev_s, rpm",
        file,
    )?;
    let voltage = column(&headers, "voltage", voltage_unit, "V, mV, kV", file)?;
    let motor = headers.iter().position(|h| normalise(h) == "motor");
    let mut motors: Vec<BackEmf> = Vec::new();
    while let Some(line) = sheet.next_line()? {
        line.check_count(headers.len(), file)?;
        let value = |column: &Column, quantity: Quantity| {
            let refuse = |code, met, rule: &str| {
                let place = Place::file(file).line(line.number);
                Error::log(code, place.column(&headers[column.at]), met, rule)
            };
            let cell = line.cells[column.at];
            let number =
                number(cell, dialect).map_err(|(code, met, rule)| refuse(code, met, rule))?;
            let value = number * column.factor;
            objection(quantity, number, value).map_or(Ok(value), |(code, rule)| {
                Err(refuse(code, format!("`{}`", printable(cell)), rule))
            })
        };
        let (v, u) = (
            value(&speed, Quantity::Velocity)?,
            value(&voltage, Quantity::Torque)?,
        );
        let name = motor.map_or("motor", |m| line.cells[m].trim());
        let known = motors.iter().position(|m| m.motor == name);
        let at = known.unwrap_or_else(|| {
            motors.push(BackEmf {
                motor: name.to_owned(),
                ..BackEmf::default()
            });
            motors.len() - 1
        });
        motors[at].speed.push(v);
        motors[at].voltage.push(u);
    }
    let mut notes = vec![format!("CSV: {dialect}")];
    let assumed = [(&speed, "speed in rad/s"), (&voltage, "voltage in V")];
    let assumed: Vec<&str> = assumed
        .iter()
        .filter(|(c, _)| !c.declared)
        .map(|(_, text)| *text)
        .collect();
    if !assumed.is_empty() {
        notes.push(format!(
            "no unit declared, SI assumed: {}",
            assumed.join(", ")
        ));
    }
    let used = [Some(speed.at), Some(voltage.at), motor];
    let ignored: Vec<&str> = (0..headers.len())
        .filter(|&c| !used.contains(&Some(c)))
        .map(|c| headers[c].as_str())
        .collect();
    if !ignored.is_empty() {
        notes.push(list("columns left out:", &ignored, ""));
    }
    Ok((motors, notes))
}

/// The one column whose header is a name, with or without a unit.
fn column(
    headers: &[String],
    name: &str,
    factor: impl Fn(&str) -> Option<f64>,
    units: &str,
    file: &str,
) -> Result<Column, Error> {
    let rest = |h: &String| {
        let rest = normalise(h).strip_prefix(name)?.to_owned();
        (rest.is_empty() || rest.starts_with('_')).then(|| rest.trim_start_matches('_').to_owned())
    };
    let found: Vec<(usize, String)> = headers
        .iter()
        .enumerate()
        .filter_map(|(at, h)| Some((at, rest(h)?)))
        .collect();
    let refuse =
        |code, met: String, rule: String| Err(Error::log(code, Place::file(file), met, rule));
    match found.as_slice() {
        [(at, unit)] => {
            let declared = !unit.is_empty();
            let known = if declared { factor(unit) } else { Some(1.0) };
            match known {
                Some(factor) => Ok(Column {
                    at: *at,
                    factor,
                    declared,
                }),
                None => refuse(
                    "unit",
                    format!("column `{}`", printable(&headers[*at])),
                    format!(
                        "`{}` is no unit of a {name}; the units are {units}",
                        printable(unit)
                    ),
                ),
            }
        }
        [] => {
            let there: Vec<&str> = headers.iter().map(String::as_str).collect();
            refuse(
                "missing-column",
                format!("no column `{name}`; {}", list("the file has", &there, "it has no columns")),
                "name the columns speed (rad/s) and voltage (V), with a unit as speed_rpm where it is another, and motor where there are several".into(),
            )
        }
        many => refuse(
            "ambiguous-column",
            format!("{} columns of {name}", many.len()),
            "leave one of them".into(),
        ),
    }
}
