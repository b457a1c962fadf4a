//! `sketchnav param`: the parameters in force in a running system, including the defaults.
//!
//! They are read-only. A stage takes its parameters when it starts, and its successor after a death takes the same, so
//! that those in a recording hold for every message in it.

use anyhow::{Context, anyhow};
use sketchnav_runtime::System;
use sketchnav_schemas::mission::Parameters;

use crate::args::{Param, ParamOptions};
use crate::failure::{Failure, OrInput, Outcome};
use crate::output::out;
use crate::systems;

/// Prints one parameter, or all.
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
    let parameters = (navigator.parameters)(&run.mission, &run.robot);
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
        return Err(Failure::Input(anyhow!("{key}: expected one of {}", nearest(key, &all))));
    };
    match options.json {
        true => out!("{}", serde_json::to_string(value).context("the value as JSON")?)?,
        false => out!("{value}")?,
    }
    Ok(Outcome::Success)
}

/// The names of the parameters of the process that is meant, or all names.
fn nearest(key: &str, all: &[(String, &toml::Value)]) -> String {
    let process = key.split('.').next().unwrap_or_default();
    let of = |process: &str| {
        let names = all.iter().map(|(name, _)| name.as_str());
        names.filter(|name| name.split('.').next() == Some(process) || process.is_empty()).collect::<Vec<_>>()
    };
    let near = of(process);
    if near.is_empty() { of("").join(", ") } else { near.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_key_is_answered_with_those_of_its_process() {
        let parameters: Parameters = "localizer.beams = 3\nplanner.a.b = 1\nplanner.c = 'x'".parse().unwrap();
        let all = parameters.all();
        assert_eq!(nearest("planner.d", &all), "planner.a.b, planner.c");
        assert_eq!(nearest("pilot.d", &all), "localizer.beams, planner.a.b, planner.c");
    }
}
