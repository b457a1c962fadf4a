//! The pages of a study: one with its tables next to those of the paper, and one for each participant.

use maud::{Markup, PreEscaped, html};
use sketchnav_lab::page;
use sketchnav_pad::study::folder::{Everyone, PAGE, TABLE};
use sketchnav_pad::study::record::{Facts, Kept, SCALE, STATEMENTS};
use sketchnav_pad::study::tables;

/// Returns the page of the study.
pub fn study(facts: &Facts, everyone: &Everyone) -> String {
    let Everyone { kept, left_out } = everyone;
    let shown = match facts.shows_floor {
        true => {
            "Participants saw the floor from above before they drew; in the paper they saw the place itself."
        }
        false => "The page showed nothing of the place.",
    };
    let suggestions = kept.iter().filter_map(|kept| {
        let text = kept.answers.as_ref()?.suggestions.trim();
        (!text.is_empty()).then_some((kept.participant.code.as_str(), text))
    });
    let suggestions: Vec<_> = suggestions.collect();
    let body = html! {
        h1 { "User study" }
        p.lead { "As in Boniardi et al. 2016, section V, with " (facts.words()) ". " (shown) }
        @if !left_out.is_empty() {
            p.notice { (left_out.len()) " left out, because they cannot be read or judged:" }
            @for words in left_out { p.notice { (words) } }
        }
        @for table in tables::tables(kept) {
            h2 { (table.title) }
            (page::table(&table.header, &table.rows))
            p.small { (table.note) }
        }
        h2 { "Participants" }
        @if kept.is_empty() { p { "Nobody has taken part yet." } } @else { (participants(kept)) }
        @if !suggestions.is_empty() {
            h2 { "Suggestions" }
            @for (code, text) in suggestions { p { b { (code) } ": " (text) } }
        }
    };
    page::document("User study · sketchnav pad", &body)
}

/// Returns a table with a row for each participant, without the answers.
fn participants(kept: &[Kept]) -> Markup {
    let (header, rows) = tables::participants(kept);
    let shown = header.len() - STATEMENTS.len() - 1;
    html! {
        div.scroll {
            table {
                thead { tr { @for cell in &header[..shown] { th scope="col" { (cell) } } } }
                tbody {
                    @for row in &rows {
                        tr {
                            th scope="row" { a href={ (row[0]) "/" (PAGE) } { (row[0]) } }
                            @for cell in &row[1..shown] { td { (cell) } }
                        }
                    }
                }
            }
        }
        p.small { "With the answers: " a href=(TABLE) { (TABLE) } }
    }
}

/// Returns the page of a participant. `pictures` are pictures of the drive, as SVG.
pub fn participant(kept: &Kept, pictures: &[String]) -> String {
    let (header, mut rows) = tables::participants(std::slice::from_ref(kept));
    let facts = header.len() - STATEMENTS.len() - 1;
    let cells = rows.pop().unwrap_or_default();
    let facts: Vec<_> =
        header.into_iter().zip(cells).take(facts).map(|(name, cell)| vec![name, cell]).collect();
    let rating = |key: &str| kept.answers.as_ref().and_then(|answers| answers.ratings.get(key)).copied();
    let word = |rating: u8| SCALE.get(usize::from(rating).wrapping_sub(1)).copied().unwrap_or("–");
    let answers = STATEMENTS
        .iter()
        .map(|statement| vec![statement.text.to_owned(), rating(statement.key).map_or("–", word).to_owned()]);
    let suggestions = kept.answers.as_ref().map_or("", |answers| answers.suggestions.trim());
    let reason = kept.outcome.as_ref().map_or("", |outcome| outcome.reason.as_str());
    let code = &kept.participant.code;
    let body = html! {
        h1 { (code) }
        (page::table(&[], &facts))
        @if !reason.is_empty() { p { "The robot said: " (reason) } }
        @if let Some(drive) = &kept.drive {
            p {
                "Files: " a href=(drive.drawing) { (drive.drawing) } ", " a href=(drive.path) { (drive.path) }
                "; recording " (drive.recording)
            }
        }
        div.pictures { @for svg in pictures { figure { (PreEscaped(svg)) } } }
        h2 { "Answers" }
        (page::table(&[], &answers.collect::<Vec<_>>()))
        @if !suggestions.is_empty() { p { (suggestions) } }
        p.small { a href={ "../" (PAGE) } { "All participants" } }
    };
    page::document(&format!("{code} · sketchnav pad"), &body)
}

#[cfg(test)]
mod tests {
    use sketchnav_pad::study::record::{Answers, Orientation, Participant, VERSION};

    use super::*;

    fn facts() -> Facts {
        Facts {
            version: VERSION,
            mission: "a <b>".into(),
            method: "outline".into(),
            start_heading_deg: 0.0,
            goal: Default::default(),
            shows_floor: true,
        }
    }

    fn kept() -> Kept {
        let ratings = STATEMENTS.iter().map(|statement| (statement.key.to_owned(), 4)).collect();
        Kept {
            participant: Participant { code: "p-1".into(), age: None, sheet: Orientation::Portrait },
            drive: None,
            answers: Some(Answers { ratings, suggestions: "<script>more</script>".into() }),
            outcome: None,
        }
    }

    #[test]
    fn without_participants_the_page_has_only_the_papers_figures() {
        let page = study(&facts(), &Everyone::default());
        for words in [
            "2.38 ± 1.42",
            "68.0 % (48 to 83) of 25",
            "mean 4.09",
            "Nobody has taken part yet",
            "a &lt;b&gt;",
        ] {
            assert!(page.contains(words), "{words}");
        }
        assert!(!page.contains("left out"));
    }

    #[test]
    fn answers_are_escaped_and_omissions_are_named() {
        let left_out = vec!["p-2/answers.json: expected <this>".to_owned()];
        let page = study(&facts(), &Everyone { kept: vec![kept()], left_out });
        for words in [
            "&lt;script&gt;more",
            "1 left out",
            "expected &lt;this&gt;",
            "href=\"p-1/index.html\"",
            "participants.csv",
        ] {
            assert!(page.contains(words), "{words}");
        }
        let page = participant(&kept(), &["<svg id=\"a\"></svg>".to_owned()]);
        for words in ["<svg id=\"a\"></svg>", "Agree", "&lt;script&gt;more", "href=\"../index.html\""] {
            assert!(page.contains(words), "{words}");
        }
    }
}
