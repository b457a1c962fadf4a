//! Summarizes how the processes of a run recovered from being killed.

use std::collections::BTreeMap;
use std::fmt::{self, Display, Formatter};

use serde::Serialize;
use sketchnav_schemas::statistics::median;

use super::Kill;

/// Maximum number of recoveries whose times are listed instead of summarized.
const LISTED: usize = 10;

/// The kills and starvations of one process, and its recoveries.
#[derive(Debug, Default, PartialEq, Serialize)]
pub struct Recoveries {
    kills: usize,
    starvations: usize,
    /// Times from a kill until the process had done new work, in milliseconds by the wall clock. If the process was killed again
    /// before that, or the mission ended, the kill is not included.
    recovered_ms: Vec<f64>,
    median_ms: Option<f64>,
}

/// Groups the kills by process.
pub fn recoveries(kills: &[Kill]) -> BTreeMap<&'static str, Recoveries> {
    let mut by_process: BTreeMap<_, Recoveries> = BTreeMap::new();
    for kill in kills {
        let of_process = by_process.entry(kill.process.word()).or_default();
        let count = if kill.is_starved { &mut of_process.starvations } else { &mut of_process.kills };
        *count += 1;
        of_process.recovered_ms.extend(kill.recovered_ms);
        of_process.median_ms = median(&of_process.recovered_ms);
    }
    by_process
}

impl Display for Recoveries {
    /// Describes every kill: how long its recovery took, or that there was none.
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let counted = |count: usize, what: &str| {
            let ending = if count == 1 { "" } else { "s" };
            (count > 0).then(|| format!("{count:4} {what}{ending}"))
        };
        let hits = [counted(self.kills, "kill"), counted(self.starvations, "starvation")];
        f.write_str(&hits.into_iter().flatten().collect::<Vec<_>>().join(","))?;
        let times = &self.recovered_ms;
        let unrecovered = self.kills.saturating_sub(times.len());
        match self.median_ms {
            Some(median) if times.len() > LISTED => {
                let longest = times.iter().copied().fold(0.0, f64::max);
                write!(f, ", recovered after {median:.0} ms (median), {longest:.0} at most")?;
            }
            Some(_) => {
                let listed: Vec<_> = times.iter().map(|time| format!("{time:.0}")).collect();
                write!(f, ", recovered after {} ms", listed.join(", "))?;
            }
            None => {}
        }
        match unrecovered {
            0 => Ok(()),
            _ if times.is_empty() => write!(f, ", no recovery: it sent nothing new before the mission ended"),
            count => {
                write!(f, "; {count} without: it sent nothing new before the next kill or the mission's end")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use sketchnav_schemas::codes::Process;

    use super::*;

    fn kill(process: Process, recovered_ms: Option<f64>) -> Kill {
        Kill { process, recovered_ms, is_starved: false }
    }

    /// Regression test: a process that had not recovered when the mission ended was once left out, so that the rows did not add
    /// up.
    #[test]
    fn every_kill_is_in_a_row() {
        let starved = Kill { is_starved: true, ..kill(Process::Planner, None) };
        let kills = [
            kill(Process::Localizer, Some(496.4)),
            kill(Process::Sketcher, None),
            kill(Process::Localizer, Some(65.0)),
            kill(Process::World, Some(80.0)),
            kill(Process::World, None),
            starved,
        ];
        let rows = recoveries(&kills);
        let row = |process: &str| rows[process].to_string();
        assert_eq!(row("localizer"), "   2 kills, recovered after 496, 65 ms");
        assert_eq!(rows["localizer"].median_ms, Some(280.7));
        assert_eq!(row("sketcher"), "   1 kill, no recovery: it sent nothing new before the mission ended");
        assert_eq!(
            row("world"),
            "   2 kills, recovered after 80 ms; 1 without: it sent nothing new before the next kill or the mission's end"
        );
        assert_eq!(row("planner"), "   1 starvation");
        assert_eq!(rows.values().map(|row| row.kills + row.starvations).sum::<usize>(), kills.len());
    }

    #[test]
    fn the_times_of_many_kills_are_summarized() {
        let kills: Vec<_> = (1..=12).map(|i| kill(Process::World, Some(f64::from(i)))).collect();
        let words = recoveries(&kills)["world"].to_string();
        assert_eq!(words, "  12 kills, recovered after 6 ms (median), 12 at most");
    }
}
