//! Draws a snapshot as a table of the processes, the last faults and the keys. This requires neither a
//! terminal nor a system.

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::Line;
use ratatui::widgets::{Cell, Paragraph, Row as TableRow, Table};
use sketchnav_schemas::shown::one_line;

use super::gather::{Row, Snapshot};

const HEADS: [&str; 10] =
    ["process", "pid", "state", "restarts", "rate", "queue", "age", "step", "longest", "lost"];
const WIDTHS: [u16; 10] = [11, 9, 9, 8, 11, 6, 10, 10, 10, 6];
const KEYS: &str = "↑ ↓ choose   x kill   s stop   c continue   q quit";

/// Draws the snapshot with the selected process marked. `said` is the result of the last key.
pub fn draw(frame: &mut Frame<'_>, snapshot: &Snapshot, chosen: usize, said: &str) {
    let rows = snapshot.processes.len() as u16;
    let [head, table, faults, foot] = Layout::vertical([
        Constraint::Length(2),
        Constraint::Length(rows + 2),
        Constraint::Min(0),
        Constraint::Length(2),
    ])
    .areas(frame.area());
    frame.render_widget(Paragraph::new(heading(snapshot)), head);
    let widths = WIDTHS.map(Constraint::Length);
    let lines = snapshot.processes.iter().enumerate().map(|(i, row)| line(row, i == chosen));
    let titles = TableRow::new(HEADS).style(Style::new().add_modifier(Modifier::BOLD));
    frame.render_widget(Table::new(lines, widths).header(titles), table);
    let lines: Vec<_> = snapshot.faults.iter().rev().map(|fault| Line::from(one_line(fault))).collect();
    frame.render_widget(Paragraph::new(lines), faults);
    frame.render_widget(Paragraph::new(vec![Line::from(one_line(said)), Line::from(KEYS)]), foot);
}

/// Formats the snapshot as plain lines.
pub fn text(snapshot: &Snapshot) -> String {
    let mut lines: Vec<String> = heading(snapshot).iter().map(ToString::to_string).collect();
    let padded = |cells: [String; 10]| {
        let cells = cells.iter().zip(WIDTHS).map(|(cell, width)| format!("{cell:<0$}", usize::from(width)));
        cells.collect::<Vec<_>>().join(" ").trim_end().to_owned()
    };
    lines.push(padded(HEADS.map(str::to_owned)));
    lines.extend(snapshot.processes.iter().map(|row| padded(cells(row))));
    lines.extend(snapshot.faults.iter().map(one_line));
    lines.join("\n")
}

fn heading(snapshot: &Snapshot) -> Vec<Line<'static>> {
    let Snapshot { system, mission, simulated_s, status, .. } = snapshot;
    vec![
        Line::from(one_line(format_args!("{system}: {mission}, {simulated_s:.1} s simulated"))),
        Line::from(one_line(status)),
    ]
}

fn line(row: &Row, is_chosen: bool) -> TableRow<'static> {
    let color = match row.state {
        "dead" => Color::Red,
        "stopped" | "traced" => Color::Yellow,
        _ => Color::Reset,
    };
    let style = Style::new().fg(color);
    let style = if is_chosen { style.add_modifier(Modifier::REVERSED) } else { style };
    TableRow::new(cells(row).map(Cell::from)).style(style)
}

fn cells(row: &Row) -> [String; 10] {
    let or_dash = |text: Option<String>| text.unwrap_or_else(|| "–".to_owned());
    let ms = |ms: Option<f64>| or_dash(ms.map(|ms| format!("{ms:.2} ms")));
    [
        row.process.to_owned(),
        or_dash(row.pid.map(|pid| pid.to_string())),
        row.state.to_owned(),
        row.restarts.to_string(),
        format!("{:.1} Hz", row.rate_hz),
        or_dash(row.queue.map(|queue| queue.to_string())),
        or_dash(row.age_ms.map(|ms| format!("{ms:.0} ms"))),
        ms(row.step_ms),
        ms(row.step_max_ms),
        row.lost.to_string(),
    ]
}

#[cfg(test)]
mod tests {
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;

    use super::*;

    fn snapshot() -> Snapshot {
        let row = |process, pid, state| Row {
            process,
            pid,
            state,
            restarts: 2,
            rate_hz: 20.04,
            queue: Some(3),
            age_ms: Some(41.6),
            step_ms: Some(0.256),
            step_max_ms: Some(1.5),
            lost: 0,
        };
        let sketcher = Row { queue: None, age_ms: None, ..row("sketcher", None, "dead") };
        Snapshot {
            system: "lab".into(),
            mission: "building-a".into(),
            simulated_s: 12.34,
            status: "task 1 of 9, 0 → 1: driving; 0 reached".into(),
            processes: vec![row("planner", Some(4711), "stopped"), sketcher],
            faults: vec!["     3.1 s  planner died".into(), "     3.4 s  planner recovered 120 ms".into()],
        }
    }

    fn drawn(width: u16, height: u16) -> Vec<String> {
        let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
        terminal.draw(|frame| draw(frame, &snapshot(), 1, "planner: SIGSTOP sent")).unwrap();
        let buffer = terminal.backend().buffer().clone();
        let line = |y| (0..width).map(|x| buffer[(x, y)].symbol()).collect::<String>().trim_end().to_owned();
        (0..height).map(line).collect()
    }

    #[test]
    fn a_system_is_drawn() {
        let lines = drawn(100, 14);
        let expected = [
            "lab: building-a, 12.3 s simulated",
            "task 1 of 9, 0 → 1: driving; 0 reached",
            "process     pid       state     restarts rate        queue  age        step       longest    lost",
            "planner     4711      stopped   2        20.0 Hz     3      42 ms      0.26 ms    1.50 ms    0",
            "sketcher    –         dead      2        20.0 Hz     –      –          0.26 ms    1.50 ms    0",
            "",
            "     3.4 s  planner recovered 120 ms",
            "     3.1 s  planner died",
        ];
        assert_eq!(lines[..8], expected);
        assert_eq!(lines[12..], ["planner: SIGSTOP sent", KEYS]);
    }

    #[test]
    fn the_selected_process_is_marked_and_the_dead_one_red() {
        let mut terminal = Terminal::new(TestBackend::new(100, 14)).unwrap();
        terminal.draw(|frame| draw(frame, &snapshot(), 1, "")).unwrap();
        let buffer = terminal.backend().buffer();
        assert_eq!((buffer[(0, 3)].fg, buffer[(0, 4)].fg), (Color::Yellow, Color::Red));
        assert!(buffer[(0, 4)].modifier.contains(Modifier::REVERSED));
        assert!(!buffer[(0, 3)].modifier.contains(Modifier::REVERSED));
    }

    /// A fault's text comes from its process and could contain anything.
    #[test]
    fn no_text_of_a_process_controls_the_terminal() {
        let words = "planner\u{1b}[2J\u{202e}\nforged";
        let snapshot = Snapshot { status: words.into(), faults: vec![words.into()], ..snapshot() };
        let text = text(&snapshot);
        assert_eq!(text.matches("planner\\u001b[2J\\u202e\\nforged").count(), 2, "{text}");
        let mut terminal = Terminal::new(TestBackend::new(100, 14)).unwrap();
        terminal.draw(|frame| draw(frame, &snapshot, 0, words)).unwrap();
        let shown = terminal.backend().to_string();
        assert_eq!(shown.matches("\\u001b[2J\\u202e\\nforged").count(), 3, "{shown}");
    }

    #[test]
    fn a_small_terminal_is_drawn_without_panic() {
        for (width, height) in [(1, 1), (20, 3), (80, 5)] {
            drawn(width, height);
        }
    }

    #[test]
    fn the_text_shows_the_same() {
        let lines = drawn(100, 14);
        let text = text(&snapshot());
        assert_eq!(text.lines().take(5).collect::<Vec<_>>(), lines[..5]);
        assert!(text.ends_with("planner recovered 120 ms"));
    }
}
