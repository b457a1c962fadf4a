//! Prints the mean deformation of drawings with seeds 1 to 200, next to that of people's drawings: `figures MAP…`.

use std::path::Path;

use sketchnav_deform::{Deformation, PEOPLE};

const SEEDS: u64 = 200;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    print("people", &figures(&PEOPLE));
    for path in std::env::args().skip(1) {
        let floor = sketchnav_deform::files::floor(Path::new(&path))?;
        println!("{}: {} regions, {} doors", floor.name, floor.regions().len(), floor.doorways().len());
        for degree in [0.0, 0.5, 1.0, 1.5] {
            let (mut means, mut annotated) = ([0.0; 6], [0.0; 6]);
            for seed in 1..=SEEDS {
                let drawing = sketchnav_deform::deform(&floor, degree, seed)?;
                for (means, found) in
                    [(&mut means, drawing.deformation), (&mut annotated, drawing.as_annotated)]
                {
                    let found = figures(&found.ok_or("too few places")?);
                    means.iter_mut().zip(found).for_each(|(mean, value)| *mean += value / SEEDS as f64);
                }
            }
            print(&format!("degree {degree}"), &means);
            print("annotated", &annotated);
        }
    }
    Ok(())
}

fn figures(d: &Deformation) -> [f64; 6] {
    [d.similarity_residual, d.affine_residual, d.anisotropy, d.log_scale_sd, d.scale_p05, d.scale_p95]
}

fn print(what: &str, [similarity, affine, anisotropy, sd, low, high]: &[f64; 6]) {
    println!(
        "{what:>11}: residual {similarity:.2} (affine {affine:.2}), anisotropy {anisotropy:.2}, log scale sd {sd:.2}, 5 to 95 % {low:.2} to {high:.2}"
    );
}
