//! Everything from the outside: texts in, faults or images out.
//!
//! - `bad`: every file of `tests/bad` gives the errors that stand at its head
//! - `bad_scenes`: scenes with one fault each are refused with the reason
//! - `bench_run`: a bench of a few pixels from end to end
//! - `bench_shards`: a bench in parts, joined
//! - `bench_page`: the page of kept results of a bench, in a browser
//! - `closed_forms`: light whose amount is known on paper, in every pixel
//! - `coats`: clear coats in a graph that traces paths
//! - `command`: exit codes, messages and files of the `lightgraph` command
//! - `culling`: draws that leave out what their members don't see change nothing
//! - `endings`: a loop that ends on the device ends as one that the host ends
//! - `fastest`: of two alternatives the faster one runs, and is remembered
//! - `following`: probes that follow the camera capture one slab a step, and nothing pops
//! - `graph_snapshots`: every test of `tests/graphs` holds
//! - `hostile`: what a stranger's project may try ends in a fault, within time and memory
//! - `snapshot_checks`: every kind of check, steps of a script, lost devices
//! - `reloads`: random edits end in what a fresh start gives
//! - `turned`: a room turned against the grid of probes keeps its light
//! - `report_page`: the page of results in a browser
//! - `tutorial`: docs/tutorial.md does what it says
//! - `test_command`: `lightgraph test` and `lightgraph new`
//! - `editor`: the language server, driven as an editor drives it
//! - `edits`: plan after plan, what did not change is not run, and all equals full runs
//! - `large_graph`: 1,000 passes, parsed and planned in time
//! - `last_frame`: what shaders know of the last frame, of time and of the pointer
//! - `lesser_devices`: what a device lacks is told, and all else goes on
//! - `library`: public types in other programs
//! - `lists`: prefix sums, compaction, sorting and counts of buffers, against their twins
//! - `lobes`: glossy lobes against their integrals and another renderer
//! - `many_lights`: lights lit in groups, held against lights lit one by one
//! - `open_air`: environments, suns and cameras that files don't hold
//! - `mutations`: the tests of `tests/graphs` notice what is edited
//! - `panes`: what light goes through, in first frames and in later ones
//! - `projection`: factors of the projection, fitted and windowed
//! - `probe`: what one invocation computed, against a readback
//! - `record`: frames recorded into a program's commands, with memory of its own
//! - `references`: images and probes against another renderer
//! - `renderers`: graphs beside other programs, as `bench --speed` sets them
//! - `dirty`: what moves is drawn again only where it is seen
//! - `seams`: soft visibility leaves no steps on flat walls
//! - `shipped`: every graph, shader and scene of the repository is found and sound
//! - `shader_checks`: what shaders find wrong by themselves
//! - `skips`: frames that leave steps out equal frames in full, whatever moves
//! - `smooth`: coarse triangles shaded by smooth normals show no spots
//! - `mutants`: mutants of every kind of file, within memory and time
//! - `mutated`: damaged texts and files give faults with places, never a panic
//! - `snapshots`: one tiny picture of the whole
//! - `steady`: a pass more is no allocation more
//! - `stress`: numerical stability: the cases that matter most
//! - `toggles`: every field of the language, edited live
//! - `traced`: graphs that trace rays, against another renderer and against rasterisation
//! - `trace`: traces of runs for Perfetto and Chrome
//! - `trusted`: the end of the bounce loop, held to what it promises
//! - `twins`: shaders against the Rust of the same mathematics
//! - `watch`: live reload without a window
//! - `web`: what `export web` writes
//! - `window`: the window, on a virtual display, and another program's scene in it
//! - `support`, `device`, `browser`: what several of them need

mod bad;
mod bad_scenes;
mod bench_page;
mod bench_run;
mod bench_shards;
mod browser;
mod camera_rays;
mod cleared;
mod closed_forms;
mod coats;
mod command;
mod culling;
mod device;
mod dirty;
#[cfg(feature = "lsp")]
mod editor;
mod edits;
mod endings;
mod fastest;
mod following;
mod furnace;
mod graph_snapshots;
mod hostile;
mod keyed;
mod large_graph;
mod last_frame;
mod lesser_devices;
mod library;
mod lists;
mod lobes;
mod many_lights;
mod mutants;
mod mutated;
mod mutations;
mod open_air;
mod panes;
mod parts;
mod plain_scenes;
mod planes;
mod poses;
mod probe;
mod projection;
mod record;
mod reference;
mod references;
mod reloads;
mod renderers;
mod report_page;
mod seams;
mod shader_checks;
mod shipped;
mod skips;
mod smooth;
mod snapshot_checks;
mod snapshots;
mod steady;
mod stress;
mod support;
mod tables;
mod test_command;
mod toggles;
mod trace;
mod traced;
mod trusted;
mod turned;
mod tutorial;
mod twins;
mod unbiased;
mod watch;
mod web;
// A virtual display is a thing of X11.
#[cfg(all(feature = "window", target_os = "linux"))]
mod window;
mod written;
