//! Finds the task that a person refers to by name.

use crate::mission::{Mission, Task, task_key};
use crate::nearest::{folded, nearest_name};

/// The reason why a name does not refer to a task.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NameError {
    /// No task and no goal has this name.
    #[error("{name}: expected the name of a task, or of the place that is its goal; {}", meant(nearest.as_deref()))]
    Unknown {
        /// The name.
        name: String,
        /// The name that was probably meant.
        nearest: Option<String>,
    },
    /// Several tasks have this name or this goal.
    #[error("{name}: expected one task, found {first} and {second}; say which by its number")]
    Several {
        /// The name.
        name: String,
        /// The first of the tasks.
        first: String,
        /// The second of the tasks.
        second: String,
    },
}

fn meant(nearest: Option<&str>) -> String {
    nearest.map_or_else(
        || "the mission has none that is similar".to_owned(),
        |name| format!("did you mean {name:?}?"),
    )
}

/// Returns the index of the task with the given name or, if there is no such task, of the one whose goal is the place with the
/// given name. Case and spaces are ignored.
///
/// # Errors
/// [`NameError`] if there is no such task, with the name that was probably meant, or if there are several.
pub fn task(mission: &Mission, name: &str) -> Result<usize, NameError> {
    let of_goals = mission.task.iter().map(|task| goal(task).unwrap_or_default()).collect::<Vec<_>>();
    let of_tasks = mission.task.iter().map(|task| task.name.as_str()).collect::<Vec<_>>();
    let wanted = folded(name);
    let found =
        |names: &[&str]| -> Vec<usize> { (0..names.len()).filter(|&i| folded(names[i]) == wanted).collect() };
    let found = [&of_tasks, &of_goals].into_iter().map(|names| found(names)).find(|found| !found.is_empty());
    match found.as_deref() {
        Some([index]) => Ok(*index),
        Some([first, second, ..]) => {
            let key = |i: usize| task_key(i + 1, &mission.task[i].name);
            Err(NameError::Several { name: name.to_owned(), first: key(*first), second: key(*second) })
        }
        _ => Err(unknown(name, &[of_tasks, of_goals].concat())),
    }
}

/// Returns the place that is a task's goal, if the goal is a name.
fn goal(task: &Task) -> Option<&str> {
    task.given.get("goal")?.as_str()
}

fn unknown(name: &str, names: &[&str]) -> NameError {
    let names: Vec<_> = names.iter().copied().filter(|name| !name.is_empty()).collect();
    let nearest = nearest_name(name, &names).map(|i| names[i].to_owned());
    NameError::Unknown { name: name.to_owned(), nearest }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn index(name: &str) -> Result<usize, String> {
        let mission = "name = 'm'\nrobot = 'robotino'\nworld = { map = 'm.yaml' }\nnavigator = { kind = 'sketch' }\n\
             start = { world = [0, 0], world_heading_deg = 0 }\n\
             [[task]]\nname = 'Coffee'\ngoal = 'kitchen'\n[[task]]\nname = 'hall'\ngoal = [1, 2]\n\
             [[task]]\nname = 'office'\ngoal = 'office 3'\n[[task]]\nname = 'washing up'\ngoal = 'Kitchen'\n\
             [[task]]\nname = 'home'\ngoal = 'hall'\n[[task]]\nname = 'tea'\ngoal = 'Cüche'\n";
        let mission = Mission::parse(mission).unwrap();
        task(&mission, name).map_err(|error| error.to_string())
    }

    #[test]
    fn a_task_is_found_by_its_name_or_by_its_goal() {
        assert_eq!(index("coffee"), Ok(0));
        assert_eq!(index(" Office  3 "), Ok(2));
        assert_eq!(index("cu\u{308}che"), Ok(5), "with a combining mark");
        assert_eq!(index("hall"), Ok(1), "the task of this name precedes the one that leads there");
    }

    #[test]
    fn a_name_that_is_no_task_s_or_several_tasks_is_refused() {
        let error = index("kitchen").unwrap_err();
        assert_eq!(
            error,
            "kitchen: expected one task, found task 1 (Coffee) and task 4 (washing up); say which by its number"
        );
        assert!(index("ofice 3").unwrap_err().ends_with("did you mean \"office 3\"?"));
        assert!(index("library").unwrap_err().ends_with("the mission has none that is similar"));
    }
}
