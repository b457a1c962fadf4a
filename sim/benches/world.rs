//! Measures how long the floor takes for the motion in an instant, for its sensors, and for the rays of a scan, which are cast by
//! the tree of faces, by the sweep, and by rapier's query pipeline.

#[path = "../tests/support/mod.rs"]
mod support;

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::Vector2;
use rapier2d::prelude::*;
use sketchnav_schemas::geometry::{Pose, World as WorldFrame};
use sketchnav_sim::raycast::Faces;
use sketchnav_sim::raycast::sweep::Rays;
use sketchnav_sim::{Floor, Simulation, WorldDescription, files, floor_plan, robots};
use support::{Readings, command};

const BEAMS: u32 = 683;
const RANGE_M: f64 = 5.6;

/// A building with a corridor of 30 m and ten rooms on each side, each with a desk.
fn building() -> WorldDescription {
    let mut text = String::from("name='offices'\nwall_thickness_m=0.15\n");
    text += "[[wall]]\nclosed=true\npoints=[[0,0],[30,0],[30,12],[0,12]]\n";
    for y in [5, 7] {
        text += &format!("[[wall]]\npoints=[[0,{y}],[30,{y}]]\n");
    }
    for room in 0..10 {
        let x = 3 * room;
        for (low, high, wall) in [(0, 5, 5), (7, 12, 7)] {
            text += &format!("[[wall]]\npoints=[[{x},{low}],[{x},{high}]]\n");
            text += &format!("[[door]]\nat=[{x}.9,{wall}]\nwidth_m=0.9\n");
            text += &format!("[[furniture]]\ncenter=[{x}.9,{low}.6]\nsize=[1.2,0.6]\n");
        }
    }
    floor_plan::parse(&text).expect("a valid floor plan")
}

/// Returns the map of Building 079, if it is available.
fn building_079() -> Option<WorldDescription> {
    files::map_file(&needs::data().join("maps/Freiburg79_scan_furnitures.yaml")).ok()
}

fn rays() -> Vec<(f64, f64)> {
    let step = 240_f64.to_radians() / f64::from(BEAMS - 1);
    (0..BEAMS).map(|i| (f64::from(i) * step - 2.0).sin_cos()).map(|(sin, cos)| (cos, sin)).collect()
}

fn casts(criterion: &mut Criterion, name: &str, description: &WorldDescription, from: (f64, f64)) {
    let furniture = description.furniture.iter().flat_map(|solid| solid.edges());
    let faces: Vec<_> = description.outline.iter().copied().chain(furniture).collect();
    let mut group = criterion.benchmark_group(format!("{name}: 683 rays, {} faces", faces.len()));
    let (rays, origin) = (rays(), Vector::new(from.0 as f32, from.1 as f32));

    let tree = Faces::new(faces);
    let start = Vector2::new(from.0, from.1);
    group.bench_function("tree of faces", |b| {
        b.iter(|| rays.iter().filter_map(|r| tree.cast(start, Vector2::new(r.0, r.1), RANGE_M)).sum::<f64>());
    });

    let step = 240_f64.to_radians() / f64::from(BEAMS - 1);
    let swept = Rays::new(-2.0, step, rays.iter().map(|r| Vector2::new(r.0, r.1)));
    let mut ranges = vec![0.0; BEAMS as usize];
    group.bench_function("sweep of faces", |b| b.iter(|| tree.sweep(start, &swept, RANGE_M, &mut ranges)));

    let ray = |r: &(f64, f64)| Ray::new(origin, Vector::new(r.0 as f32, r.1 as f32));
    let mut rapier = PhysicsWorld::new();
    for solid in description.walls.iter().chain(&description.furniture) {
        let corners: Vec<_> = solid.corners().iter().map(|c| Vector::new(c[0] as f32, c[1] as f32)).collect();
        rapier.insert_collider(ColliderBuilder::convex_polyline(corners).expect("a convex solid"), None);
    }
    rapier.detect_collisions(&(), &());
    let query = rapier.broad_phase.as_query_pipeline(
        rapier.narrow_phase.query_dispatcher(),
        &rapier.bodies,
        &rapier.colliders,
        QueryFilter::default(),
    );
    group.bench_function("rapier query pipeline", |b| {
        b.iter(|| {
            let hits = rays.iter().filter_map(|r| query.cast_ray(&ray(r), RANGE_M as f32, true));
            hits.map(|(_, range)| range).sum::<f32>()
        });
    });
    group.finish();
}

fn steps(criterion: &mut Criterion, name: &str, description: &WorldDescription, from: (f64, f64)) {
    for robot in ["robotino", "nomad200"] {
        let robot = robots::find(robot).ok().flatten().expect("a robot that ships");
        let start = Pose::<WorldFrame>::new(from.0, from.1, 0.0);
        let mut floor = Floor::new(description.clone(), &robot, start, 1).expect("a valid world");
        let mut readings = Readings::new();
        let name = format!("{name}, {}", robot.name);
        criterion.bench_function(&format!("{name}: sensors"), |b| {
            b.iter(|| {
                readings.log.clear();
                readings.take(&floor);
            });
        });
        criterion.bench_function(&format!("{name}: motion"), |b| {
            b.iter(|| floor.step(Some(&command(&floor, 0.3, 0.0, 0.6))));
        });
    }
}

fn all(criterion: &mut Criterion) {
    let worlds = [("offices", Some(building()), (10.0, 6.0)), ("building 079", building_079(), (18.0, 18.0))];
    for (name, description, from) in worlds {
        match description {
            Some(description) => {
                casts(criterion, name, &description, from);
                steps(criterion, name, &description, from);
            }
            None => eprintln!("skipped: {name}, whose map is not at hand"),
        }
    }
}

criterion_group!(benches, all);
criterion_main!(benches);
