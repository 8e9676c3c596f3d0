//! `.npy` files: buffers and images as arrays of NumPy (format 1.0, little-endian).

use lightgraph::internals::plan::{Binding, ResourceId};
use lightgraph::internals::shader::{BindingKind, Layout};
use lightgraph::internals::value::Type;
use lightgraph::{Image, Plan};

/// A buffer: of a plain type an array of numbers, with a column for each component; of a struct an array of records
/// with its members' names; `u32` where no shader says.
pub fn of_buffer(plan: &Plan, id: ResourceId, words: &[u32]) -> Vec<u8> {
    let (dtype, columns, bytes) = element(plan, id).unwrap_or(("'<u4'".into(), 1, 4));
    let in_each = (bytes / 4).max(1) as usize;
    let count = words.len() / in_each;
    let shape = if columns > 1 { format!("({count}, {columns})") } else { format!("({count},)") };
    let content = words.iter().take(count * in_each).flat_map(|w| w.to_le_bytes()).collect();
    file(&dtype, &shape, content)
}

/// An image: rows, columns, channels; of several layers these first.
pub fn of_image(image: &Image) -> Vec<u8> {
    let Image { width, height, layers, channels, data } = image;
    let layers = if *layers > 1 { format!("{layers}, ") } else { String::new() };
    let content = data.iter().flat_map(|x| x.to_le_bytes()).collect();
    file("'<f4'", &format!("({layers}{height}, {width}, {channels})"), content)
}

/// The type of a buffer's elements, as the shaders of a plan have it, how many of it there are in each, and its bytes.
fn element(plan: &Plan, id: ResourceId) -> Option<(String, u32, u32)> {
    plan.steps.iter().find_map(|step| {
        let variables = &plan.shaders[step.action.shader()?].interface.variables;
        step.bindings.iter().zip(variables).find_map(|(binding, variable)| match (binding, &variable.kind) {
            (Binding::Resource(bound), BindingKind::Storage { element, stride, of: Some(_), .. }) if *bound == id => {
                let (dtype, columns) = dtype(element, *stride)?;
                Some((dtype, columns, *stride))
            }
            _ => None,
        })
    })
}

fn dtype(element: &Layout, stride: u32) -> Option<(String, u32)> {
    let mut members: Vec<_> = element.members.iter().collect();
    members.sort_by_key(|m| m.offset);
    if let [one] = members[..] {
        // Padding is a column, too.
        return Some((format!("'{}'", scalar(one.ty).0), stride / 4));
    }
    let (mut fields, mut at) = (vec![], 0);
    for m in &members {
        let (scalar, count) = scalar(m.ty);
        if m.offset > at {
            fields.push(format!("('', '|V{}')", m.offset - at));
        }
        let many = if count > 1 { format!(", ({count},)") } else { String::new() };
        fields.push(format!("('{}', '{scalar}'{many})", m.name));
        at = m.offset + 4 * count;
    }
    if stride > at {
        fields.push(format!("('', '|V{}')", stride - at));
    }
    (!members.is_empty()).then(|| (format!("[{}]", fields.join(", ")), 1))
}

/// The type of a value's numbers, and how many it has.
fn scalar(ty: Type) -> (&'static str, u32) {
    match ty {
        Type::Bool | Type::Uint => ("<u4", 1),
        Type::Int => ("<i4", 1),
        Type::Float => ("<f4", 1),
        Type::UVec2 => ("<u4", 2),
        Type::UVec3 => ("<u4", 3),
        Type::UVec4 => ("<u4", 4),
        Type::Vec2 => ("<f4", 2),
        Type::Vec3 => ("<f4", 3),
        Type::Vec4 => ("<f4", 4),
        Type::Mat4 => ("<f4", 16),
    }
}

fn file(dtype: &str, shape: &str, content: Vec<u8>) -> Vec<u8> {
    let mut header = format!("{{'descr': {dtype}, 'fortran_order': False, 'shape': {shape}, }}");
    // The content begins at a multiple of 64 bytes, behind 10 of the magic and a line break.
    let padded = (10 + header.len() + 1).next_multiple_of(64) - 11;
    header.extend(std::iter::repeat_n(' ', padded - header.len()));
    header.push('\n');
    let length = (header.len() as u16).to_le_bytes();
    [b"\x93NUMPY\x01\x00", &length[..], header.as_bytes(), &content].concat()
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightgraph::internals::shader::Member;

    fn members(all: &[(&str, u32, Type)]) -> Layout {
        let member = |(name, offset, ty): &(&str, u32, Type)| (String::from(*name), *offset, *ty);
        let member = |m| {
            let (name, offset, ty) = member(m);
            Member { name, offset, ty, read: true }
        };
        Layout { size: 0, members: all.iter().map(member).collect() }
    }

    #[test]
    fn elements_are_numbers_or_records() {
        let plain = |ty, stride| dtype(&members(&[("a", 0, ty)]), stride);
        assert_eq!(plain(Type::Uint, 4).unwrap(), ("'<u4'".into(), 1));
        assert_eq!(plain(Type::Vec4, 16).unwrap(), ("'<f4'".into(), 4));
        assert_eq!(plain(Type::Vec3, 16).unwrap(), ("'<f4'".into(), 4), "the padding is a column");
        let record = members(&[("position", 0, Type::Vec3), ("life", 12, Type::Float), ("id", 16, Type::Uint)]);
        assert_eq!(
            dtype(&record, 32).unwrap().0,
            "[('position', '<f4', (3,)), ('life', '<f4'), ('id', '<u4'), ('', '|V12')]"
        );
        assert_eq!(dtype(&members(&[]), 8), None);
    }

    #[test]
    fn images_have_rows_first() {
        let image = Image::new(3, 2, 1, vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0]).unwrap();
        let bytes = of_image(&image);
        assert_eq!(bytes.len(), 128 + 24);
        let header = String::from_utf8_lossy(&bytes[10..128]).into_owned();
        assert!(header.starts_with("{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3, 1), }"), "{header}");
        assert!(header.ends_with('\n'));
        assert_eq!(bytes[128..], [0.0f32, 1.0, 2.0, 3.0, 4.0, 5.0].map(f32::to_le_bytes).concat());
    }
}
