//! Two people pass each other in a corridor. Prints QTC_C and QTC_BC for each sample, and the distances between the people.
//!
//! `cargo run -p sketchnav-qualitative --example encounter`

use sketchnav_qualitative::argd::{Bound, Scale};
use sketchnav_qualitative::{Calculus, Error, Options, Point, Quantisation, Stream, qtc, series};

/// One person walks east and sidesteps the other, who walks west.
fn scene(time_s: f64) -> Result<[Point; 2], Error> {
    let x = -4.0 + 1.2 * time_s;
    let sidestep = 0.6 * (-x * x).exp();
    Ok([Point::new(x, -sidestep)?, Point::new(4.0 - 1.2 * time_s, 0.0)?])
}

fn main() -> Result<(), Error> {
    let mut stream = Stream::new(qtc::Switching::default(), Options::default());
    let distances = Scale::new([("close", 1.0), ("near", 2.5), ("far", 5.0)], Bound::Upper)?;
    for i in 0..70 {
        let time_s = f64::from(i) * 0.1;
        let scene = scene(time_s)?;
        for timed in stream.push(time_s, Some(scene))? {
            let distance = distances.relate(None, &scene).and_then(|rank| distances.label(rank));
            let (from_s, to_s) = (timed.from_s, timed.to_s);
            let distance = distance.unwrap_or_default();
            println!(
                "{from_s:.1}..{to_s:.1} s {:<8} {:?}, {distance}",
                timed.relation.to_string(),
                timed.change
            );
        }
    }
    let samples = (0..70).map(|i| Ok((f64::from(i) * 0.1, Some(scene(f64::from(i) * 0.1)?))));
    let samples = samples.collect::<Result<Vec<_>, Error>>()?;
    let slow = qtc::DoubleCross { quantisation: Quantisation::speed(0.3)? };
    println!("QTC_C of what is faster than 0.3 m/s:");
    for timed in series(slow, Options::default(), samples)? {
        println!("{:.1}..{:.1} s {:#}", timed.from_s, timed.to_s, timed.relation);
    }
    Ok(())
}
