//! `sketchnav top`: a terminal view of a running system.

mod gather;
mod view;

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use anyhow::{Context, ensure};
use nix::sys::signal::Signal;
use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use sketchnav_runtime::{System, Wake};

use crate::args::TopOptions;
use crate::failure::{Failure, OrInput, Outcome};
use crate::output::{self, out};
use crate::systems;
use gather::{Gatherer, Row, Snapshot};

/// Interval at which to poll for messages, since messages do not wake observers.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// Interval between updates of the figures, which is also the period over which rates are measured.
const REFRESH: Duration = Duration::from_secs(1);

/// Shows a system until the user quits or the system ends, or prints it once.
pub fn top(options: &TopOptions) -> Result<Outcome, Failure> {
    let system = systems::find(options.system.as_deref())?;
    let mut gatherer = Gatherer::join(system).context("joining the system").or_input()?;
    if options.json || options.once {
        let snapshot = observe(&mut gatherer)?;
        match options.json {
            true => out!("{}", serde_json::to_string(&snapshot).context("the snapshot as JSON")?)?,
            false => output::lines(view::text(&snapshot))?,
        }
        return Ok(Outcome::Success);
    }
    let mut terminal = terminal().or_input()?;
    let shown = Screen::new(gatherer).and_then(|mut screen| screen.run(&mut terminal));
    ratatui::restore();
    output::lines(shown?)?;
    Ok(Outcome::Success)
}

fn terminal() -> anyhow::Result<DefaultTerminal> {
    let advice = "expected a terminal; --once and --json need none";
    ensure!(std::io::stdout().is_terminal(), advice);
    ratatui::try_init().context(advice)
}

/// Observes the system for as long as measuring its rates takes.
fn observe(gatherer: &mut Gatherer) -> anyhow::Result<Snapshot> {
    gatherer.snapshot()?;
    let began = Instant::now();
    while began.elapsed() < REFRESH && gatherer.node().nap(LOOK_EVERY) != Wake::Terminate {
        gatherer.look()?;
    }
    gatherer.snapshot()
}

/// The state of the screen.
struct Screen {
    gatherer: Gatherer,
    snapshot: Snapshot,
    taken: Instant,
    chosen: usize,
    said: String,
}

impl Screen {
    fn new(mut gatherer: Gatherer) -> anyhow::Result<Self> {
        let snapshot = gatherer.snapshot()?;
        Ok(Self { gatherer, snapshot, taken: Instant::now(), chosen: 0, said: String::new() })
    }

    /// Runs until the user quits or the system ends, and returns a final message.
    fn run(&mut self, terminal: &mut DefaultTerminal) -> anyhow::Result<String> {
        let name = self.snapshot.system.clone();
        loop {
            terminal.draw(|frame| view::draw(frame, &self.snapshot, self.chosen, &self.said))?;
            if event::poll(LOOK_EVERY)?
                && let Event::Key(key) = event::read()?
                && key.kind == KeyEventKind::Press
                && self.press(key)
            {
                return Ok(view::text(&self.snapshot));
            }
            let has_ended = self.taken.elapsed() >= REFRESH && System::open(&name).is_err();
            if self.gatherer.node().end_requested() || has_ended {
                return Ok(format!("{name} has ended"));
            }
            self.refresh()?;
        }
    }

    fn refresh(&mut self) -> anyhow::Result<()> {
        if self.taken.elapsed() < REFRESH {
            return self.gatherer.look();
        }
        self.taken = Instant::now();
        self.snapshot = self.gatherer.snapshot()?;
        Ok(())
    }

    /// Handles a key, and returns true if it quits.
    fn press(&mut self, key: KeyEvent) -> bool {
        let last = self.snapshot.processes.len().saturating_sub(1);
        match key.code {
            KeyCode::Char('c') if key.modifiers.contains(KeyModifiers::CONTROL) => return true,
            KeyCode::Char('q') | KeyCode::Esc => return true,
            KeyCode::Down | KeyCode::Char('j') => self.chosen = (self.chosen + 1).min(last),
            KeyCode::Up | KeyCode::Char('k') => self.chosen = self.chosen.saturating_sub(1),
            KeyCode::Char('x') => self.send(Signal::SIGKILL),
            KeyCode::Char('s') => self.send(Signal::SIGSTOP),
            KeyCode::Char('c') => self.send(Signal::SIGCONT),
            _ => {}
        }
        false
    }

    fn send(&mut self, signal: Signal) {
        let Some(Row { process, pid, .. }) = self.snapshot.processes.get(self.chosen) else { return };
        let sent = match (pid, process.parse()) {
            (Some(pid), Ok(known)) => self.gatherer.node().system().inject(known, *pid, signal, "top"),
            _ => return self.said = format!("{process} is dead"),
        };
        self.said = match sent {
            Ok(()) => format!("{process}: {signal} sent"),
            Err(error) => error.to_string(),
        };
    }
}
