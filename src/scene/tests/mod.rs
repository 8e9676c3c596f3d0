//! Tests of whole scenes, from bytes to tables.

mod animation;
mod bad_input;
mod compressed;
mod deformed;
mod features;
mod files;
mod fixture;
mod levels;
mod meshes;
mod motion;
mod rays;
mod rooms;
mod swept;
mod views;
