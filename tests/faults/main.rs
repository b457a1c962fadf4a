//! What goes wrong: kills, full disks, bad input, attacks; and what is left afterwards.

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
