use super::*;

/// The state survives being written and read back.
#[test]
fn a_successor_reads_what_its_predecessor_has_written() {
    let mut sendings = Sendings { pending: Some("first".into()), answered: None };
    assert_eq!(sendings.again(None), None);
    assert_eq!(sendings.again(Some("first")), Some(None));
    sendings.answer(&Ok(json!({ "seq": 1, "wall_direction_rad": 0.25 })));
    let saved = BTreeSet::from(["my-room.toml".to_owned()]);
    let state = State { sendings, saved, driver: Some("me".into()), ..State::default() };
    let mut slot = [0; 1024];
    let read: State = postcard::from_bytes(postcard::to_slice(&state, &mut slot).unwrap()).unwrap();
    let told = Some(Some(Ok(json!({ "seq": 1, "wall_direction_rad": 0.25 }))));
    assert_eq!(read.sendings.again(Some("first")), told);
    assert_eq!(read.sendings.again(Some("second")), None);
    assert!(read.saved.contains("my-room.toml"));
    let refused = Sendings { pending: None, answered: Some(("third".into(), Err("no walls".into()))) };
    let told = Some(Some(Err(Refusal::Drawing("no walls".into()))));
    assert_eq!(refused.again(Some("third")), told);
}
