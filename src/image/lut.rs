//! Tables of colours as `.cube` text: what a colour becomes, by red, green and blue.
//!
//! Format: "Cube LUT Specification 1.0" (Adobe, 2013). Lines go from the darkest colour to the brightest, red fastest.

use super::Image;

/// Colours along an axis at most, as the specification says.
const MOST_EDGE: u32 = 256;

/// A solid image of three channels: red along x, green along y, blue along its layers.
///
/// # Errors
/// What is wrong with the text, with the line.
pub(super) fn parse(text: &str, most: u64) -> Result<Image, String> {
    let mut edge = 0;
    let mut data: Vec<f32> = vec![];
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.trim();
        let wrong = |what: &str| format!("line {number} {what}");
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        match word {
            "" | "TITLE" => {}
            word if word.starts_with('#') => {}
            "LUT_3D_SIZE" => {
                edge = rest.trim().parse().unwrap_or(0);
                if !(2..=MOST_EDGE).contains(&edge) || u64::from(edge).pow(3) > most {
                    return Err(wrong(&format!("states no size from 2 to {MOST_EDGE}")));
                }
            }
            "LUT_1D_SIZE" => return Err(wrong("states a table of one axis; one of three is wanted (LUT_3D_SIZE)")),
            "DOMAIN_MIN" | "DOMAIN_MAX" | "LUT_3D_INPUT_RANGE" => {
                let usual: &[f32] = match word {
                    "DOMAIN_MIN" => &[0.0; 3],
                    "DOMAIN_MAX" => &[1.0; 3],
                    _ => &[0.0, 1.0],
                };
                if numbers(rest).as_deref() != Some(usual) {
                    return Err(wrong("states another range of colours than 0 to 1; export the table for that"));
                }
            }
            _ => match numbers(line).as_deref() {
                Some([r, g, b]) if edge > 0 && data.len() < 3 * (edge as usize).pow(3) => data.extend([r, g, b]),
                Some([_, _, _]) if edge == 0 => return Err(wrong("holds a colour before LUT_3D_SIZE")),
                Some([_, _, _]) => return Err(wrong(&format!("is one colour more than the {edge}³ of the table"))),
                _ => return Err(wrong("is neither a colour, three numbers, nor a word of the format")),
            },
        }
    }
    let wanted = (edge as usize).pow(3);
    if edge == 0 || data.len() != 3 * wanted {
        return Err(format!("it has {} of the {wanted} colours of its table", data.len() / 3));
    }
    Ok(Image { width: edge, height: edge, layers: edge, channels: 3, data })
}

fn numbers(text: &str) -> Option<Vec<f32>> {
    text.split_whitespace().map(|w| w.parse().ok().filter(|x: &f32| x.is_finite())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn red_runs_fastest() {
        let text = "# a comment\nTITLE \"t\"\nLUT_3D_SIZE 2\nDOMAIN_MIN 0 0 0\nDOMAIN_MAX 1.0 1.0 1.0\n\
                    0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 0 1\n1 0 1\n0 1 1\n1 1 1e0\n";
        let table = parse(text, 8).unwrap();
        assert_eq!((table.width, table.height, table.layers, table.channels), (2, 2, 2, 3));
        assert_eq!(table.pixel(0, 1, 0), Some(&[1.0, 0.0, 0.0][..]));
        assert_eq!(table.pixel(1, 0, 0), Some(&[0.0, 0.0, 1.0][..]));
    }

    #[test]
    fn faults_name_the_line() {
        for (text, said) in [
            ("LUT_3D_SIZE 1", "line 1 states no size"),
            ("LUT_3D_SIZE 4000000000", "line 1 states no size"),
            ("LUT_1D_SIZE 4", "line 1 states a table of one axis"),
            ("0 0 0", "line 1 holds a colour before"),
            ("LUT_3D_SIZE 2\n0 0 nan", "line 2 is neither"),
            ("LUT_3D_SIZE 2\n0 0 0", "1 of the 8 colours"),
            ("LUT_3D_SIZE 2\nDOMAIN_MAX 2 2 2", "line 2 states another range"),
            ("", "it has 0 of the 0"),
        ] {
            let why = parse(text, 1 << 20).unwrap_err();
            assert!(why.contains(said), "{text}: {why}");
        }
        let long = format!("LUT_3D_SIZE 2\n{}", "0 0 0\n".repeat(9));
        assert!(parse(&long, 8).unwrap_err().contains("line 10 is one colour more"));
        assert!(parse("LUT_3D_SIZE 3", 8).is_err(), "more texels than allowed");
    }
}
