//! Places for a network: passes in rows by depth, loops as frames around rows of their own.
//!
//! After Sugiyama, Tagawa and Toda, "Methods for Visual Understanding of Hierarchical System Structures" (1981): rows
//! by longest path, an order in the rows by the mean place of neighbours, and lanes by which a wire passes the rows
//! between its ends, so that no wire crosses a box.

use super::network::{Network, NetworkItem};
use std::collections::{BTreeMap, BTreeSet};

/// Between neighbours in a row, in px as all lengths here.
const GAP: f32 = 22.0;
/// Between rows, where the wires turn.
const TURN: f32 = 46.0;
/// What a wire takes of a row that it passes.
const LANE: f32 = 8.0;
/// Around the rows of a loop.
const PAD: f32 = 18.0;
/// Height of a loop's title, past which wires go straight.
const TITLE: f32 = 26.0;

/// How much room a pass takes, and where on its lower edge its ports sit, from its left.
pub(super) struct BoxExtent {
    pub width: f32,
    pub height: f32,
    /// Port, distance from the left.
    pub ports: Vec<(usize, f32)>,
}

/// A box, x to the right and y down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rect {
    pub x: f32,
    pub y: f32,
    pub width: f32,
    pub height: f32,
}

/// A part of a port's way: through the points, down all the way.
#[derive(Debug, Clone, PartialEq)]
pub struct WireLine {
    pub port: usize,
    pub points: Vec<[f32; 2]>,
    /// It ends at a pass.
    pub arrow: bool,
}

/// A network with places.
#[derive(Default)]
pub(super) struct NetworkLayout {
    pub width: f32,
    pub height: f32,
    /// By pass.
    pub passes: BTreeMap<usize, Rect>,
    /// Outer loops first.
    pub loops: Vec<(String, Rect)>,
    pub wires: Vec<WireLine>,
    /// Where ports come in from above, and leave below.
    entry: BTreeMap<usize, f32>,
    exit: BTreeMap<usize, f32>,
}

/// Lays out a network whose passes take `extents`.
pub(super) fn layout(net: &Network, extents: &[BoxExtent]) -> NetworkLayout {
    block(net, extents, &net.items, 0.0)
}

/// A pass or loop of a block, or a wire that passes a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum RowCell {
    BlockPart(usize),
    Lane(usize),
}

struct BlockPart {
    width: f32,
    height: f32,
    pass: Option<usize>,
    title: String,
    inner: NetworkLayout,
}

/// A port that has to do with a block.
struct PortPath {
    /// The part it starts at; `None`: it comes from above.
    source: Option<usize>,
    readers: BTreeSet<usize>,
    leaves: bool,
}

struct Block<'n> {
    /// From the upper edge to the first row.
    top: f32,
    extents: &'n [BoxExtent],
    parts: Vec<BlockPart>,
    ways: BTreeMap<usize, PortPath>,
    /// By part.
    depth: Vec<usize>,
    rows: Vec<Vec<RowCell>>,
    /// The left edge of each cell of each row.
    left: BTreeMap<(usize, RowCell), f32>,
}

/// The rows of one block, `top` below its upper edge.
fn block(net: &Network, extents: &[BoxExtent], items: &[NetworkItem], top: f32) -> NetworkLayout {
    let mut parts = vec![];
    let mut home: BTreeMap<usize, usize> = BTreeMap::new();
    for (i, item) in items.iter().enumerate() {
        match item {
            NetworkItem::Pass(p) => {
                let e = &extents[*p];
                home.insert(*p, i);
                let (pass, inner) = (Some(*p), NetworkLayout::default());
                parts.push(BlockPart { width: e.width, height: e.height, pass, title: String::new(), inner });
            }
            NetworkItem::Loop { title, body } => {
                let inner = block(net, extents, body, TITLE + TURN);
                home.extend(inner.passes.keys().map(|p| (*p, i)));
                let (width, height) = (inner.width + 2.0 * PAD, inner.height + TURN / 2.0);
                parts.push(BlockPart { width, height, pass: None, title: title.clone(), inner });
            }
        }
    }
    let ways = ways(net, &home);
    let depth = depths(parts.len(), &ways);
    let mut b = Block { top, extents, parts, ways, depth, rows: vec![], left: BTreeMap::new() };
    b.fill_rows();
    b.arrange();
    b.place()
}

fn ways(net: &Network, home: &BTreeMap<usize, usize>) -> BTreeMap<usize, PortPath> {
    let mut ways = BTreeMap::new();
    for (i, port) in net.ports.iter().enumerate() {
        let source = home.get(&port.pass).copied();
        let mut readers: BTreeSet<usize> = port.readers.iter().filter_map(|r| home.get(r)).copied().collect();
        readers.retain(|r| Some(*r) != source);
        let leaves = source.is_some() && port.readers.iter().any(|r| !home.contains_key(r));
        if leaves || !readers.is_empty() {
            ways.insert(i, PortPath { source, readers, leaves });
        }
    }
    ways
}

/// Rows by longest path; what reads nothing stands just above its first reader.
fn depths(parts: usize, ways: &BTreeMap<usize, PortPath>) -> Vec<usize> {
    let mut links: Vec<(usize, usize)> = vec![];
    for way in ways.values() {
        links.extend(way.source.iter().flat_map(|s| way.readers.iter().map(|r| (*s, *r))));
    }
    links.sort_unstable();
    let mut depth = vec![0usize; parts];
    // Links lead from earlier to later parts.
    for part in 0..parts {
        let above = links.iter().filter(|l| l.1 == part).map(|l| depth[l.0] + 1);
        depth[part] = above.max().unwrap_or(0);
    }
    for part in (0..parts).rev() {
        let below = links.iter().filter(|l| l.0 == part).map(|l| depth[l.1]).min();
        if let Some(below) = below
            && !ways.values().any(|w| w.readers.contains(&part))
        {
            depth[part] = below.saturating_sub(1);
        }
    }
    depth
}

impl Block<'_> {
    /// The rows that a way passes between its ends.
    fn lanes(&self, way: &PortPath) -> std::ops::Range<usize> {
        let start = way.source.map_or(0, |s| self.depth[s] + 1);
        let last = way.readers.iter().map(|r| self.depth[*r]).max().unwrap_or(0);
        start..if way.leaves { self.depth.iter().max().map_or(0, |d| d + 1) } else { last }
    }

    fn fill_rows(&mut self) {
        let count = self.depth.iter().max().map_or(0, |d| d + 1);
        let mut rows: Vec<Vec<RowCell>> = vec![vec![]; count];
        for (i, depth) in self.depth.iter().enumerate() {
            rows[*depth].push(RowCell::BlockPart(i));
        }
        for (port, way) in &self.ways {
            self.lanes(way).for_each(|r| rows[r].push(RowCell::Lane(*port)));
        }
        self.rows = rows;
    }

    fn width(&self, cell: RowCell) -> f32 {
        match cell {
            RowCell::BlockPart(i) => self.parts[i].width,
            RowCell::Lane(_) => LANE,
        }
    }

    /// Where in a cell a port leaves it, from the cell's left.
    fn out_at(&self, cell: RowCell, port: usize) -> f32 {
        let RowCell::BlockPart(i) = cell else { return LANE / 2.0 };
        let part = &self.parts[i];
        match part.pass {
            Some(p) => self.extents[p].ports.iter().find(|x| x.0 == port).map_or(part.width / 2.0, |x| x.1),
            None => part.inner.exit.get(&port).map_or(part.width / 2.0, |x| x + PAD),
        }
    }

    /// Where in a cell a port comes in, from the cell's left. Passes take theirs in the order of `left`.
    fn in_at(&self, row: usize, cell: RowCell, port: usize) -> f32 {
        let RowCell::BlockPart(i) = cell else { return LANE / 2.0 };
        let part = &self.parts[i];
        if part.pass.is_none() {
            return part.inner.entry.get(&port).map_or(part.width / 2.0, |x| x + PAD);
        }
        let mut inputs: Vec<(f32, usize)> = self.inputs(cell).map(|p| (self.above(row, p).unwrap_or(0.0), p)).collect();
        inputs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let at = inputs.iter().position(|x| x.1 == port).unwrap_or(0);
        part.width * (at + 1) as f32 / (inputs.len() + 1) as f32
    }

    fn inputs(&self, cell: RowCell) -> impl Iterator<Item = usize> {
        self.ways.iter().filter_map(move |(port, way)| match cell {
            RowCell::BlockPart(i) => way.readers.contains(&i).then_some(*port),
            RowCell::Lane(p) => (p == *port).then_some(p),
        })
    }

    /// The cell of the row above that a port comes from.
    fn carrier(&self, row: usize, port: usize) -> Option<RowCell> {
        let way = self.ways.get(&port)?;
        let above = row.checked_sub(1)?;
        match way.source {
            Some(s) if self.depth[s] == above => Some(RowCell::BlockPart(s)),
            _ => Some(RowCell::Lane(port)),
        }
    }

    /// The x at which a port comes down to a row.
    fn above(&self, row: usize, port: usize) -> Option<f32> {
        let cell = self.carrier(row, port)?;
        self.left.get(&(row - 1, cell)).map(|x| x + self.out_at(cell, port))
    }

    /// The cells of a row that a port goes on to.
    fn takers(&self, row: usize, port: usize) -> Vec<RowCell> {
        let Some(way) = self.ways.get(&port) else { return vec![] };
        let lane = self.lanes(way).contains(&row).then_some(RowCell::Lane(port));
        let parts = way.readers.iter().filter(|r| self.depth[**r] == row).map(|r| RowCell::BlockPart(*r));
        lane.into_iter().chain(parts).collect()
    }

    /// The mean by which a cell would move to stand straight under (or above) its neighbours.
    fn wish(&self, row: usize, cell: RowCell, down: bool) -> f32 {
        let left = self.left.get(&(row, cell)).copied().unwrap_or(0.0);
        let mut moves: Vec<f32> = vec![];
        if down {
            moves.extend(self.inputs(cell).filter_map(|p| Some(self.above(row, p)? - left - self.in_at(row, cell, p))));
        } else {
            let ports: Vec<usize> = match cell {
                RowCell::Lane(p) => vec![p],
                RowCell::BlockPart(i) => self.ways.iter().filter(|w| w.1.source == Some(i)).map(|w| *w.0).collect(),
            };
            for p in ports {
                for taker in self.takers(row + 1, p) {
                    let x = self.left.get(&(row + 1, taker)).copied().unwrap_or(0.0);
                    moves.push(x + self.in_at(row + 1, taker, p) - left - self.out_at(cell, p));
                }
            }
        }
        let mean = moves.iter().sum::<f32>() / moves.len().max(1) as f32;
        left + mean
    }

    /// Orders each row and finds its places: down, up and down again, each cell towards its neighbours.
    fn arrange(&mut self) {
        for row in 0..self.rows.len() {
            let mut x = 0.0;
            for cell in self.rows[row].clone() {
                self.left.insert((row, cell), x);
                x += self.width(cell) + GAP;
            }
        }
        for round in 0..12 {
            let down = round % 2 == 0;
            let count = self.rows.len();
            for step in 0..count {
                let row = if down { step } else { count - 1 - step };
                let mut wishes: Vec<(f32, RowCell)> =
                    self.rows[row].iter().map(|c| (self.wish(row, *c, down), *c)).collect();
                let middle = |w: &(f32, RowCell)| w.0 + self.width(w.1) / 2.0;
                wishes.sort_by(|a, b| middle(a).total_cmp(&middle(b)).then(a.1.cmp(&b.1)));
                let widths: Vec<f32> = wishes.iter().map(|w| self.width(w.1)).collect();
                let places = apart(&wishes.iter().map(|w| w.0).collect::<Vec<_>>(), &widths);
                self.rows[row] = wishes.iter().map(|w| w.1).collect();
                for (w, x) in wishes.iter().zip(places) {
                    self.left.insert((row, w.1), x);
                }
            }
        }
        let least = self.left.values().copied().fold(f32::INFINITY, f32::min);
        self.left.values_mut().for_each(|x| *x -= least);
    }

    /// Gives heights to the rows and draws the wires.
    fn place(self) -> NetworkLayout {
        let mut out = NetworkLayout::default();
        let height = |row: &[RowCell]| {
            let tall = |c: &RowCell| if let RowCell::BlockPart(i) = c { self.parts[*i].height } else { 0.0 };
            row.iter().map(tall).fold(0.0, f32::max)
        };
        let mut y = self.top;
        let mut tops = vec![];
        for row in &self.rows {
            tops.push((y, y + height(row)));
            y += height(row) + TURN;
        }
        out.height = (y - TURN).max(self.top);
        for ((_, cell), x) in &self.left {
            out.width = out.width.max(x + self.width(*cell));
        }
        for (row, cells) in self.rows.iter().enumerate() {
            for cell in cells {
                self.wires_into(row, *cell, &tops, &mut out);
            }
        }
        for (port, way) in &self.ways {
            if way.leaves
                && let Some(x) = self.above(self.rows.len(), *port)
            {
                let from = way.source.filter(|s| self.depth[*s] + 1 == self.rows.len());
                let start = from.map_or(out.height, |s| tops[self.depth[s]].0 + self.parts[s].height);
                out.exit.insert(*port, x);
                out.wires.push(WireLine {
                    port: *port,
                    points: vec![[x, start], [x, out.height + TURN / 2.0]],
                    arrow: false,
                });
            }
        }
        let depth = self.depth.clone();
        let left = self.left.clone();
        for (i, part) in self.parts.into_iter().enumerate() {
            let x = left.get(&(depth[i], RowCell::BlockPart(i))).copied().unwrap_or(0.0);
            let y = tops[depth[i]].0;
            let rect = Rect { x, y, width: part.width, height: part.height };
            match part.pass {
                Some(p) => drop(out.passes.insert(p, rect)),
                None => {
                    out.loops.push((part.title, rect));
                    out.take(part.inner, x + PAD, y);
                }
            }
        }
        out
    }

    /// The wires from the row above, and through the row where the cell is a lane.
    fn wires_into(&self, row: usize, cell: RowCell, tops: &[(f32, f32)], out: &mut NetworkLayout) {
        let Some(left) = self.left.get(&(row, cell)) else { return };
        let (head, foot) = tops[row];
        let ports: Vec<usize> = self.inputs(cell).collect();
        for port in ports {
            let x = left + self.in_at(row, cell, port);
            let mut points = vec![];
            match self.carrier(row, port) {
                Some(from) => {
                    let Some(above) = self.above(row, port) else { continue };
                    if let RowCell::BlockPart(i) = from {
                        points.push([above, tops[row - 1].0 + self.parts[i].height]);
                    }
                    points.push([above, tops[row - 1].1]);
                }
                None => {
                    let entry = *out.entry.entry(port).or_insert(x);
                    points.push([entry, 0.0]);
                    points.push([entry, (self.top - TURN).max(0.0)]);
                }
            }
            points.push([x, head]);
            let lane = matches!(cell, RowCell::Lane(_));
            if lane {
                points.push([x, foot]);
            }
            let arrow = matches!(cell, RowCell::BlockPart(i) if self.parts[i].pass.is_some());
            out.wires.push(WireLine { port, points, arrow });
        }
    }
}

impl NetworkLayout {
    /// Takes in what is inside a loop, moved to its place.
    fn take(&mut self, inner: NetworkLayout, x: f32, y: f32) {
        let moved = |r: Rect| Rect { x: r.x + x, y: r.y + y, ..r };
        self.passes.extend(inner.passes.into_iter().map(|(p, r)| (p, moved(r))));
        self.loops.extend(inner.loops.into_iter().map(|(t, r)| (t, moved(r))));
        for mut wire in inner.wires {
            wire.points.iter_mut().for_each(|p| *p = [p[0] + x, p[1] + y]);
            self.wires.push(wire);
        }
    }
}

/// The places nearest to the wished ones, in their order, at which nothing overlaps: isotonic regression by pooling
/// neighbours that collide.
fn apart(wishes: &[f32], widths: &[f32]) -> Vec<f32> {
    let mut offsets = vec![];
    let mut x = 0.0;
    for w in widths {
        offsets.push(x);
        x += w + if *w <= LANE { LANE } else { GAP };
    }
    // Mean of the pool, how many it holds.
    let mut pools: Vec<(f32, usize)> = vec![];
    for (wish, offset) in wishes.iter().zip(&offsets) {
        let mut pool = (wish - offset, 1);
        while let Some(last) = pools.last().copied()
            && last.0 > pool.0
        {
            let n = last.1 + pool.1;
            pool = ((last.0 * last.1 as f32 + pool.0 * pool.1 as f32) / n as f32, n);
            pools.pop();
        }
        pools.push(pool);
    }
    let bases = pools.into_iter().flat_map(|(mean, n)| std::iter::repeat_n(mean, n));
    bases.zip(offsets).map(|(base, offset)| base + offset).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_that_wish_for_one_place_stand_side_by_side_around_it() {
        let places = apart(&[100.0, 100.0, 500.0], &[60.0, 60.0, 60.0]);
        assert_eq!(places, [59.0, 141.0, 500.0]);
    }
}
