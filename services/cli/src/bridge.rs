//! Carries a running system's messages to other software.

use crate::args::{Other, Ros2Options};
use crate::failure::{Failure, Outcome};

/// Carries them until the system ends or the user has enough.
pub fn bridge(other: &Other) -> Result<Outcome, Failure> {
    match other {
        Other::Ros2 { options } => ros2(options),
    }
}

/// A build without DDS says what to do.
#[cfg(not(feature = "ros2"))]
fn ros2(_: &Ros2Options) -> Result<Outcome, Failure> {
    let missing = "bridge ros2: this program was built without it; build it with `cargo build --release --features ros2`";
    Err(Failure::Input(anyhow::anyhow!(missing)))
}

#[cfg(feature = "ros2")]
fn ros2(options: &Ros2Options) -> Result<Outcome, Failure> {
    with_dds::ros2(options)
}

#[cfg(feature = "ros2")]
mod with_dds {
    use anyhow::{Context, anyhow};
    use sketchnav_ros2::topics::{self, Topic};
    use sketchnav_ros2::{ORDER_TOPIC, Settings, Summary};
    use sketchnav_runtime::{Node, System};
    use sketchnav_schemas::codes::Process;
    use sketchnav_schemas::run::{Pace, RunConfig};

    use crate::args::{Ros2Options, parse_domain};
    use crate::failure::{Failure, OrInput, Outcome};
    use crate::output::{live, say};
    use crate::systems;

    /// Where ROS 2 says which domain is meant.
    const DOMAIN_VARIABLE: &str = "ROS_DOMAIN_ID";

    pub fn ros2(options: &Ros2Options) -> Result<Outcome, Failure> {
        let settings = Settings {
            domain: domain(options.domain)?,
            interfaces: options.interfaces.clone(),
            namespace: options.namespace.clone(),
            takes_orders: options.orders,
        };
        let system = systems::find(options.system.as_deref())?;
        let run = system.run_config().or_input()?;
        if options.drive { drive(system, &run, &settings) } else { publish(system, &run, options, &settings) }
    }

    fn publish(
        system: System,
        run: &RunConfig,
        options: &Ros2Options,
        settings: &Settings,
    ) -> Result<Outcome, Failure> {
        let topics = chosen(options, run)?;
        let name = &run.system;
        let node = Node::join(system, Process::Observer).with_context(|| format!("joining {name}"))?;
        let names: Vec<_> = topics.iter().map(|topic| settings.topic(topic.name)).collect();
        let orders = settings.takes_orders.then(|| format!("; orders from {}", settings.topic(ORDER_TOPIC)));
        let (domain, orders) = (settings.domain, orders.unwrap_or_default());
        live!("{name} in domain {domain}: {}{orders}", names.join(" "))?;
        let done = sketchnav_ros2::run(&node, run, &topics, settings).context("bridge ros2")?;
        Ok(told(name, &done))
    }

    /// A robot that speaks ROS 2 stands in for the world.
    fn drive(system: System, run: &RunConfig, settings: &Settings) -> Result<Outcome, Failure> {
        let name = &run.system;
        if !run.without.contains(&Process::World) || run.pace == Pace::Lockstep {
            let expected = "--drive: expected a system that was started with --without world --speed 1";
            return Err(Failure::Input(anyhow!(
                "{expected}, found {name:?}, which has a world of its own or no clock"
            )));
        }
        run.robot.laser().or_input()?;
        let node = Node::join(system, Process::World).with_context(|| format!("joining {name}"))?;
        let [scan, odom, cmd_vel] = ["scan", "odom", "cmd_vel"].map(|topic| settings.topic(topic));
        let domain = settings.domain;
        live!("{name} in domain {domain}: a robot with {scan} and {odom} is driven by {cmd_vel}")?;
        let done = sketchnav_ros2::drive(&node, run, settings).context("bridge ros2")?;
        Ok(told(name, &done))
    }

    fn told(name: &str, done: &Summary) -> Outcome {
        let Summary { sent, unsent, lost } = done;
        say!("{name}: {sent} messages sent, {unsent} without room at a subscriber's, {lost} lost before");
        Outcome::Success
    }

    fn domain(given: Option<u16>) -> Result<u16, Failure> {
        match (given, std::env::var(DOMAIN_VARIABLE)) {
            (Some(domain), _) => Ok(domain),
            (None, Ok(text)) if !text.is_empty() => {
                let parsed = parse_domain(&text);
                parsed.map_err(|error| anyhow!("{DOMAIN_VARIABLE}: {error}, found {text:?}")).or_input()
            }
            _ => Ok(0),
        }
    }

    fn chosen(options: &Ros2Options, run: &RunConfig) -> Result<Vec<Topic>, Failure> {
        let all = topics::of_run(run);
        for pattern in &options.topics {
            if !all.iter().any(|topic| pattern.is_match(topic.name)) {
                let names: Vec<_> = all.iter().map(|topic| topic.name).collect();
                let (names, found) = (names.join(", "), &pattern.text);
                return Err(Failure::Input(anyhow!(
                    "--topics: expected a match of {names}, found none for {found:?}"
                )));
            }
        }
        let is_wanted = |topic: &Topic| {
            options.topics.is_empty() || options.topics.iter().any(|pattern| pattern.is_match(topic.name))
        };
        Ok(all.into_iter().filter(is_wanted).collect())
    }
}
