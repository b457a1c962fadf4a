//! Tests of everything that can go wrong, such as kills, full disks, bad input and attacks, and of what is left
//! afterwards.

mod attacks;
mod bad_days;
mod bad_input;
mod chaos;
mod fault_plan;
mod garbage;
mod kills;
mod leftovers;
mod limits;
mod resume;
mod safety;
