//! `sketchnav param` prints the parameters of a running system, including defaults.
//!
//! Parameters cannot be changed while a system runs. A stage reads its parameters when it starts, as does the
//! stage that replaces it after a crash, so the parameters in a recording apply to every message in it.

use anyhow::{Context, anyhow};
use sketchnav_runtime::System;
use sketchnav_schemas::mission::Parameters;
use sketchnav_schemas::nearest::nearest;

use crate::args::{Param, ParamOptions};
use crate::failure::{Failure, OrInput, Outcome};
use crate::output::out;
use crate::systems;

/// Prints one parameter or all of them.
pub fn param(what: &Param) -> Result<Outcome, Failure> {
    match what {
        Param::List { options } => list(options),
        Param::Get { key, options } => get(key, options),
    }
}

fn in_force(options: &ParamOptions) -> Result<Parameters, Failure> {
    let system: System = systems::find(options.system.as_deref())?;
    let run = system.run_config().or_input()?;
    let navigator = sketchnav_navigators::of(&run.mission).or_input()?;
    let parameters = (navigator.parameters)(&run, &sketchnav_navigators::read_file);
    Ok(parameters.map_err(|error| anyhow!("{}: {error}", system.name()))?)
}

fn list(options: &ParamOptions) -> Result<Outcome, Failure> {
    let parameters = in_force(options)?;
    if options.json {
        out!("{}", serde_json::to_string(&parameters).context("the parameters as JSON")?)?;
        return Ok(Outcome::Success);
    }
    for (name, value) in parameters.all() {
        out!("{name} = {value}")?;
    }
    Ok(Outcome::Success)
}

fn get(key: &str, options: &ParamOptions) -> Result<Outcome, Failure> {
    let parameters = in_force(options)?;
    let all = parameters.all();
    let Some((_, value)) = all.iter().find(|(name, _)| name == key) else {
        return Err(Failure::Input(anyhow!("{}", unknown(key, &all))));
    };
    match options.json {
        true => out!("{}", serde_json::to_string(value).context("the value as JSON")?)?,
        false => out!("{value}")?,
    }
    Ok(Outcome::Success)
}

/// Explains that there is no such parameter. Suggests the one that was probably meant or, if there is none,
/// lists all parameters of the process or of all processes.
fn unknown(key: &str, all: &[(String, &toml::Value)]) -> String {
    let (process, rest) = key.split_once('.').unwrap_or((key, ""));
    let names = || all.iter().filter_map(|(name, _)| name.split_once('.'));
    let own: Vec<_> = names().filter(|(of, _)| *of == process).map(|(_, name)| name).collect();
    if let Some(meant) = nearest(rest, own.iter().copied()) {
        return format!("{key}: no such parameter; did you mean {process}.{meant}?");
    }
    let is_near = |(of, _): &(&str, &str)| own.is_empty() || *of == process;
    let near = names().filter(is_near).map(|(of, name)| format!("{of}.{name}"));
    format!("{key}: expected one of {}", near.collect::<Vec<_>>().join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_key_gets_the_nearest_or_those_of_its_process() {
        let parameters: Parameters = "localizer.beams = 3\nplanner.a.b = 1\nplanner.c = 'x'".parse().unwrap();
        let all = parameters.all();
        for (key, words) in [
            ("localizer.beam", "no such parameter; did you mean localizer.beams?"),
            ("planner.dull", "expected one of planner.a.b, planner.c"),
            ("planner", "expected one of planner.a.b, planner.c"),
            ("pilot.d", "expected one of localizer.beams, planner.a.b, planner.c"),
        ] {
            assert_eq!(unknown(key, &all), format!("{key}: {words}"));
        }
    }
}
