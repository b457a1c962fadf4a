//! Passes a running system's messages to other software.

use anyhow::anyhow;

use crate::args::{Other, Rmw, Ros2Options, parse_rmw};
use crate::failure::{Failure, Outcome};

/// The environment variable that selects the middleware of ROS 2.
const RMW_VARIABLE: &str = "RMW_IMPLEMENTATION";

/// Runs the bridge until the system ends or the user ends it.
pub fn bridge(other: &Other) -> Result<Outcome, Failure> {
    match other {
        Other::Ros2 { options } => ros2(options),
    }
}

fn ros2(options: &Ros2Options) -> Result<Outcome, Failure> {
    match rmw(options)? {
        #[cfg(feature = "ros2")]
        Rmw::Dds => {
            built::ros2(options, sketchnav_ros2::Middleware::Dds { interfaces: options.interfaces.clone() })
        }
        #[cfg(feature = "zenoh")]
        Rmw::Zenoh => built::ros2(options, built::zenoh(options)),
        #[cfg(not(feature = "ros2"))]
        Rmw::Dds => Err(absent("bridge ros2 by DDS", "ros2")),
        #[cfg(not(feature = "zenoh"))]
        Rmw::Zenoh => Err(absent("bridge ros2 by Zenoh", "zenoh")),
    }
}

/// Returns the error for a missing feature, which explains how to build with it.
#[cfg(not(all(feature = "ros2", feature = "zenoh")))]
fn absent(what: &str, feature: &str) -> Failure {
    let advice = format!("cargo build --features {feature}");
    Failure::Input(anyhow!("{what}: this program was built without it; build it with `{advice}`"))
}

/// Returns the middleware to use, and rejects options of the other one.
fn rmw(options: &Ros2Options) -> Result<Rmw, Failure> {
    let rmw = match (options.rmw, std::env::var(RMW_VARIABLE)) {
        (Some(rmw), _) => rmw,
        (None, Ok(text)) if !text.is_empty() => parse_rmw(&text)
            .map_err(|error| Failure::Input(anyhow!("{RMW_VARIABLE}: {error}, found {text:?}")))?,
        _ => Rmw::Dds,
    };
    let misplaced = match rmw {
        Rmw::Dds if !options.routers.is_empty() => Some(("--router", "--rmw zenoh")),
        Rmw::Dds if !options.listen.is_empty() => Some(("--listen", "--rmw zenoh")),
        Rmw::Zenoh if !options.interfaces.is_empty() => Some(("--interface", "--rmw dds")),
        _ => None,
    };
    match misplaced {
        Some((option, with)) => {
            Err(Failure::Input(anyhow!("{option}: expected this option only with {with}")))
        }
        None => Ok(rmw),
    }
}

#[cfg(any(feature = "ros2", feature = "zenoh"))]
mod built {
    use anyhow::{Context, anyhow};
    use sketchnav_driver::{Clock, Driver};
    use sketchnav_ros2::topics::{self, Topic};
    use sketchnav_ros2::{Middleware, ORDER_TOPIC, RobotTopics, Settings, Summary};
    use sketchnav_runtime::{Node, System};
    use sketchnav_schemas::codes::Process;
    use sketchnav_schemas::run::RunConfig;

    use crate::args::{Ros2Options, parse_domain};
    use crate::failure::{Failure, OrInput, Outcome};
    use crate::output::{live, say};
    use crate::step_in::named_goal;
    use crate::systems;

    /// The environment variable that selects the domain of ROS 2.
    const DOMAIN_VARIABLE: &str = "ROS_DOMAIN_ID";

    /// The Zenoh router of this host, at the default endpoint of rmw_zenoh.
    #[cfg(feature = "zenoh")]
    const ROUTER: &str = "tcp/localhost:7447";

    /// Returns the settings for Zenoh: a router if `--listen` is given, otherwise a client of the given routers or of this host's.
    #[cfg(feature = "zenoh")]
    pub fn zenoh(options: &Ros2Options) -> Middleware {
        let (mut routers, listen) = (options.routers.clone(), options.listen.clone());
        if routers.is_empty() && listen.is_empty() {
            routers.push(ROUTER.to_owned());
        }
        Middleware::Zenoh { routers, listen }
    }

    pub fn ros2(options: &Ros2Options, middleware: Middleware) -> Result<Outcome, Failure> {
        let settings = Settings {
            domain: domain(options.domain)?,
            middleware,
            namespace: options.namespace.clone(),
            takes_orders: options.orders,
        };
        let system = systems::find(options.system.as_deref())?;
        let run = system.run_config().or_input()?;
        if options.drive {
            drive(&system, &run, options, &settings)
        } else {
            publish(system, &run, options, &settings)
        }
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
        let find = |name: &str| {
            let (order, resolved) = named_goal(run, name).map_err(|error| error.to_string())?;
            resolved.iter().for_each(|resolved| crate::output::say!("{resolved}"));
            Ok(order)
        };
        let done = sketchnav_ros2::run(&node, run, &topics, settings, &find).context("bridge ros2")?;
        Ok(report(name, &done))
    }

    /// Lets a ROS 2 robot take the place of the world.
    fn drive(
        system: &System,
        run: &RunConfig,
        options: &Ros2Options,
        settings: &Settings,
    ) -> Result<Outcome, Failure> {
        let name = &run.system;
        run.robot.laser().or_input()?;
        let driver = Driver::join(system.name(), Clock::Robot).map_err(|error| match error {
            error if error.concerns_the_system() => Failure::Input(error.into()),
            error => Failure::Other(error.into()),
        })?;
        let named = |given: &Option<String>, or: &str| given.clone().unwrap_or_else(|| or.to_owned());
        let topics = RobotTopics {
            scan: named(&options.scan, "scan"),
            odom: named(&options.odom, "odom"),
            cmd_vel: named(&options.cmd_vel, "cmd_vel"),
        };
        let [scan, odom, cmd_vel] =
            [&topics.scan, &topics.odom, &topics.cmd_vel].map(|topic| settings.topic(topic));
        let domain = settings.domain;
        live!("{name} in domain {domain}: a robot with {scan} and {odom} is driven by {cmd_vel}")?;
        let done = sketchnav_ros2::drive(driver, settings, &topics).context("bridge ros2")?;
        Ok(report(name, &done))
    }

    fn report(name: &str, done: &Summary) -> Outcome {
        let Summary { sent, unsent, lost } = done;
        say!(
            "{name}: {sent} messages sent, {unsent} dropped because a subscriber was too slow, {lost} lost before that"
        );
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
