//! Where images stand on the pages of one texture array.

use super::textures::TextureArray;

/// Texels along an edge of a page, at most: what every device has.
const MAX_PAGE: u32 = 8192;

/// Where an image stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PagePlace {
    pub corner: [u32; 2],
    pub layer: u32,
}

/// The pages for blocks of these sizes, black, and where each stands. `None` without blocks.
pub(super) fn pages(blocks: &[[u32; 2]]) -> Option<(TextureArray, Vec<PagePlace>)> {
    let widest = blocks.iter().flatten().copied().max()?.max(1);
    let area: u64 = blocks.iter().map(|[w, h]| u64::from(*w) * u64::from(*h)).sum();
    // A power of two with some room for what shelves leave empty.
    let fit = ((area as f64 * 1.2).sqrt().ceil() as u32).max(widest);
    let edge = fit.checked_next_power_of_two().unwrap_or(MAX_PAGE).min(MAX_PAGE);
    let (mut width, mut height) = (edge, edge);
    let (mut places, mut layers, used) = shelves(blocks, [width, height]);
    if layers == 1 {
        // It ends where its images do.
        height = used;
    } else {
        // Many images of one size fill pages as wide as some of them.
        let narrow = MAX_PAGE / widest * widest;
        let (others, count, _) = shelves(blocks, [narrow, MAX_PAGE]);
        let texels =
            |width: u32, height: u32, layers: u32| [width, height, layers].map(u64::from).iter().product::<u64>();
        if texels(narrow, MAX_PAGE, count) < texels(width, height, layers) {
            (places, layers, width, height) = (others, count, narrow, MAX_PAGE);
        }
    }
    let texels = vec![0u8; 4 * width as usize * height as usize * layers as usize];
    Some((TextureArray { width, height, layers, mips: vec![texels] }, places))
}

/// Blocks in rows, the highest first; how many pages they take, and how high the last is filled.
fn shelves(blocks: &[[u32; 2]], [across, down]: [u32; 2]) -> (Vec<PagePlace>, u32, u32) {
    let mut order: Vec<usize> = (0..blocks.len()).collect();
    order.sort_by_key(|i| (std::cmp::Reverse(blocks[*i][1]), *i));
    let mut places = vec![PagePlace { corner: [0; 2], layer: 0 }; blocks.len()];
    let (mut x, mut y, mut shelf, mut layer) = (0, 0, 0, 0);
    for i in order {
        let [width, height] = blocks[i];
        if x + width > across {
            (x, y, shelf) = (0, y + shelf, 0);
        }
        if y + height > down {
            (x, y, shelf, layer) = (0, 0, 0, layer + 1);
        }
        places[i] = PagePlace { corner: [x, y], layer };
        x += width;
        shelf = shelf.max(height);
    }
    (places, layer + 1, y + shelf)
}

/// The bytes of each block, row by row, so that several are written at once.
pub(super) fn rows<'a>(
    array: &'a mut TextureArray,
    places: &[PagePlace],
    blocks: &[[u32; 2]],
) -> Vec<Vec<&'a mut [u8]>> {
    let (width, height) = (array.width as usize, array.height as usize);
    let mut found: Vec<Vec<&mut [u8]>> = blocks.iter().map(|_| vec![]).collect();
    let mut order: Vec<usize> = (0..blocks.len()).collect();
    order.sort_by_key(|i| (places[*i].layer, places[*i].corner[0]));
    let texels = array.mips.first_mut().map_or(&mut [][..], Vec::as_mut_slice);
    for (layer, page) in texels.chunks_exact_mut((4 * width * height).max(1)).enumerate() {
        let here: Vec<usize> = order.iter().copied().filter(|i| places[*i].layer as usize == layer).collect();
        for (y, mut row) in page.chunks_exact_mut(4 * width).enumerate() {
            let mut x = 0;
            for i in &here {
                let [left, top] = places[*i].corner.map(|n| n as usize);
                let [across, down] = blocks[*i].map(|n| n as usize);
                if (top..top + down).contains(&y) {
                    let (_, from) = std::mem::take(&mut row).split_at_mut(4 * (left - x));
                    let (own, rest) = from.split_at_mut(4 * across);
                    found[*i].push(own);
                    (row, x) = (rest, left + across);
                }
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_images_than_a_page_holds_take_more_pages() {
        let blocks = [[6144, 4096]; 5];
        let (places, layers, used) = shelves(&blocks, [MAX_PAGE; 2]);
        assert_eq!((layers, used), (3, 4096));
        assert_eq!(places[4], PagePlace { corner: [0, 0], layer: 2 });
        for (i, a) in places.iter().enumerate() {
            for b in &places[..i] {
                assert!(a.layer != b.layer || a.corner[1].abs_diff(b.corner[1]) >= 4096, "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn each_block_has_its_rows_and_no_other_ones() {
        let blocks = [[3, 2], [1, 5], [4, 4], [2, 2], [7, 1], [1, 1]];
        let (mut array, places) = pages(&blocks).unwrap();
        let rows = rows(&mut array, &places, &blocks);
        for (i, (rows, [width, height])) in rows.into_iter().zip(blocks).enumerate() {
            assert_eq!(rows.len(), height as usize);
            for row in rows {
                assert_eq!(row.len(), 4 * width as usize);
                row.iter_mut().for_each(|byte| *byte += 1 + i as u8);
            }
        }
        let count = |value: u8| array.mips[0].iter().filter(|byte| **byte == value).count();
        for (i, [width, height]) in blocks.iter().enumerate() {
            assert_eq!(count(1 + i as u8), 4 * (width * height) as usize, "block {i}");
        }
    }
}
