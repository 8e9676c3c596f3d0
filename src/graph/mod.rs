//! The graph file: text to a checked [`Graph`]. No device.
