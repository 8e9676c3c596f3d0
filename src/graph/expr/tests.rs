//! Expressions against answers by hand, and random ones against an evaluator that shares nothing with the one tested:
//! it works on trees that never were text, in 128 bits.

mod twin;

use super::parse::{DEPTH, OPERATORS};
use super::*;
use crate::diag::Source;
use proptest::prelude::*;
use twin::{N, Told, Tree};

fn names(name: &str) -> Option<Val> {
    Some(match name {
        "n" => Val::Int(5),
        "grid" => Val::Ints(vec![2, 3, 4]),
        "eps" => Val::Float(0.5),
        "at" => Val::Floats(vec![0.25, -1.0]),
        "on" => Val::Bool(true),
        _ => return None,
    })
}

fn eval(text: &str) -> Result<Val, Diagnostic> {
    Expr::parse(&Span::whole(&Source::new("e", text)), text)?.eval(&names)
}

fn says(text: &str, words: &str) {
    let d = eval(text).expect_err(text);
    let all = format!("{} {}", d.message, d.help.join(" "));
    assert!(all.contains(words), "{text}: {all}");
}

#[test]
fn arithmetic_binds_as_usual() {
    assert_eq!(eval("1 + n * 2 - 3"), Ok(Val::Int(8)));
    assert_eq!(eval("grid.x * grid.y * grid.z"), Ok(Val::Int(24)));
    assert_eq!(eval("(n + 1) / 4"), Ok(Val::Int(1)));
    assert_eq!(eval("ceil_div(n, 4) + max(1, log2(9))"), Ok(Val::Int(5)));
    assert_eq!(eval("ceil_div(grid, 2)"), Ok(Val::Ints(vec![1, 2, 2])));
    assert_eq!(eval("n > 4 && !(eps >= 1) ? 7 : 8"), Ok(Val::Int(7)));
    assert_eq!(eval("-2 - -3"), Ok(Val::Int(1)));
    assert_eq!(eval("1e-3 * 2"), Ok(Val::Float(0.002)));
    assert_eq!(eval("vec3(n, 1, grid.z)"), Ok(Val::Ints(vec![5, 1, 4])));
    assert_eq!(eval("vec2(n, eps)"), Ok(Val::Floats(vec![5.0, 0.5])));
    assert_eq!(eval("at.y"), Ok(Val::Float(-1.0)));
    assert_eq!(eval("vec2(n, eps) * 2"), Ok(Val::Floats(vec![10.0, 1.0])));
    assert_eq!(eval("grid.xz + 1"), Ok(Val::Ints(vec![3, 5])));
    assert_eq!(eval("grid.zzx.y"), Ok(Val::Int(4)));
    assert_eq!(eval("max(grid, 3)"), Ok(Val::Ints(vec![3, 3, 4])));
    assert_eq!(eval("min(vec2(n, eps), vec2(1, 1))"), Ok(Val::Floats(vec![1.0, 0.5])));
    assert_eq!(eval("floor(n * 0.3) + ceil(eps) + round(2.5)"), Ok(Val::Int(5)));
    assert_eq!(eval("round(vec2(n, eps) * 1.2)"), Ok(Val::Ints(vec![6, 1])));
    assert_eq!(eval("clamp(n, 1, 3) - clamp(eps, 1.0, 2.0)"), Ok(Val::Float(2.0)));
    assert_eq!(eval("(0 - 7) % 4"), Ok(Val::Int(1)));
    assert_eq!(eval("1.5e+1"), Ok(Val::Float(15.0)));
    assert_eq!(eval("2E2"), Ok(Val::Float(200.0)));
    assert_eq!(eval("pow(2, 10)"), Ok(Val::Int(1024)));
    assert_eq!(eval("pow(2.0, 0 - 1)"), Ok(Val::Float(0.5)));
    assert_eq!(eval("abs(0 - 3) + abs(n)"), Ok(Val::Int(8)));
    assert_eq!(eval("n ? on ? 1 : 2 : 3"), Ok(Val::Int(1)));
    // Those that bind alike go from the left.
    assert_eq!(eval("7 * 4 % 3"), Ok(Val::Int(1)));
    assert_eq!(eval("7 % 4 * 3"), Ok(Val::Int(9)));
    assert_eq!(eval("8 / 4 * 2"), Ok(Val::Int(4)));
    assert_eq!(eval("8 * 3 / 4 % 4"), Ok(Val::Int(2)));
    assert_eq!(eval("1 - 2 + 3"), Ok(Val::Int(2)));
}

#[test]
fn truths_and_vectors_are_equal_or_not() {
    for (text, truth) in [
        ("on == true", true),
        ("on == false", false),
        ("on != true", false),
        ("on != false", true),
        ("grid == vec3(2, 3, 4)", true),
        ("grid == vec3(2, 3, 5)", false),
        ("grid != vec3(2, 3, 4)", false),
        ("grid != vec3(2, 3, 5)", true),
        ("n == 5", true),
        ("n != 5", false),
        ("n == 5.0", true),
        ("eps <= 0.5", true),
        ("eps >= 0.5", true),
        ("n <= 4", false),
        ("n >= 6", false),
        // Comparisons bind alike too: the first gives a truth.
        ("1 < 2 == true", true),
    ] {
        assert_eq!(eval(text), Ok(Val::Bool(truth)), "{text}");
    }
    says("grid == vec2(2, 3)", "don't go together");
    says("at == at", "don't go together");
    says("grid == n", "don't go together");
    says("on < on", "don't go together");
}

#[test]
fn faults_are_reported_not_wrapped() {
    says("9223372036854775807 + 1", "64 bits");
    says("9223372036854775808", "64 bits");
    says("abs(-9223372036854775807 - 1)", "64 bits");
    says("-(-9223372036854775807 - 1)", "64 bits");
    says("1 / (n - 5)", "zero");
    says("1 % (n - 5)", "zero");
    says("pow(10, 40)", "64 bits");
    says("pow(10.0, 400)", "64 bits");
    says("pow(2, 0 - 1)", "64 bits");
    says("log2(0)", "positive");
    says("n n", "unexpected");
    says("mim(1, 2)", "`min`");
    says("min(1)", "takes 2");
    says("min(1 2)", "`,` or `)`");
    says("n ? 1", "expected `:`");
    says("(n", "expected `)`");
    says("grid.a", "has no value");
    says("(n + 1).a", "expected `x`");
    says("grid.w", "no such component");
    says("n.x", "an integer has no such component");
    says("at.z", "a vector of floats has no such component");
    says("nothing", "has no value");
    says("!n", "can't be done to an integer");
    says("-on", "can't be done to a boolean");
    says("-grid", "can't be done to a vector of integers");
    says("eps && on", "expected a condition, found a float");
    says("on + 1", "a boolean and an integer don't go together");
    says("grid + vec2(1, 1)", "don't go together");
    says("grid < grid", "don't go together");
    says("on == 1", "don't go together");
    says("vec2(grid, 1)", "`vec2` can't take");
    says("floor(1e300)", "64 bits");
    says("grid.xw", "component");
    says("max(grid, vec2(1, 2))", "`max` can't take");
    says("1.2.3", "not a number");
    says(&"(".repeat(100_000), "deep");
    says(&"-".repeat(100_000), "deep");
    says("", "expected a number");
}

#[test]
fn limits_are_where_they_are_said_to_be() {
    let sum = |operators| format!("1{}", " + 1".repeat(operators));
    assert_eq!(eval(&sum(OPERATORS)), Ok(Val::Int(OPERATORS as i64 + 1)));
    says(&sum(OPERATORS + 1), "too long");
    let nested = |depth| format!("{}1{}", "(".repeat(depth), ")".repeat(depth));
    assert_eq!(eval(&nested(DEPTH - 1)), Ok(Val::Int(1)));
    says(&nested(DEPTH), "too deep");
    let minus = |depth| format!("{}1", "-".repeat(depth));
    assert_eq!(eval(&minus(DEPTH - 1)), Ok(Val::Int(-1)));
    says(&minus(DEPTH), "too deep");
    // Beside each other they are not deep.
    assert_eq!(eval(&vec!["(-1)"; 200].join(" + ")), Ok(Val::Int(-200)));
    let path = |steps| format!("grid{}", ".x".repeat(steps));
    says(&path(OPERATORS + 1), "too long");
}

#[test]
fn a_fault_stands_at_its_part_of_the_expression() {
    let text = "1 + max(2, 3 / (n - 5))";
    let d = eval(text).unwrap_err();
    assert_eq!(d.labels[0].0.text(), "3 / (n - 5)");
    let text = "foo + 1";
    let d = eval(text).unwrap_err();
    assert_eq!(d.labels[0].0.text(), "foo");
    let text = "1 + mim(2, 3)";
    assert_eq!(eval(text).unwrap_err().labels[0].0.text(), "mim");
    let place = |text| {
        let span = &eval(text).unwrap_err().labels[0].0;
        span.start..span.end
    };
    assert_eq!(place("1 + $ + 2"), 4..5);
    assert_eq!(place("1 +"), 3..3);
    assert_eq!(place("(1"), 2..2);
}

#[test]
fn every_name_is_named_once_for_each_place() {
    let text = "a.x + -b * (c ? d : max(e, a))";
    let e = Expr::parse(&Span::whole(&Source::new("e", text)), text).unwrap();
    let mut found = vec![];
    e.names(&mut |name, span| found.push((name, span.start)));
    assert_eq!(found, [("a", 0), ("b", 7), ("c", 12), ("d", 16), ("e", 24), ("a", 27)]);
}

#[test]
fn values_become_those_of_shaders_where_they_fit() {
    let max = i64::from(u32::MAX);
    assert_eq!(Val::Int(max).to_value(), Some(Value::Uint(u32::MAX)));
    assert_eq!(Val::Int(max + 1).to_value(), None);
    assert_eq!(Val::Int(-1).to_value(), Some(Value::Int(-1)));
    assert_eq!(Val::Int(i64::from(i32::MIN) - 1).to_value(), None);
    assert_eq!(Val::Bool(true).to_value(), Some(Value::Bool(true)));
    assert_eq!(Val::Float(0.5).to_value(), Some(Value::Float(0.5)));
    assert_eq!(Val::Ints(vec![1, 2]).to_value(), Some(Value::UVec2(UVec2::new(1, 2))));
    assert_eq!(Val::Ints(vec![1, 2, 3]).to_value(), Some(Value::UVec3(UVec3::new(1, 2, 3))));
    assert_eq!(Val::Ints(vec![1, -2, 3]).to_value(), None);
    assert_eq!(Val::Ints(vec![1]).to_value(), None);
    assert_eq!(Val::Floats(vec![1.0, 2.0]).to_value(), Some(Value::Vec2(Vec2::new(1.0, 2.0))));
    assert_eq!(Val::Floats(vec![1.0, 2.0, 3.0]).to_value(), Some(Value::Vec3(Vec3::new(1.0, 2.0, 3.0))));
    assert_eq!(Val::Floats(vec![1.0, 2.0, 3.0, 4.0]).to_value(), Some(Value::Vec4(Vec4::new(1.0, 2.0, 3.0, 4.0))));
    assert_eq!(Val::Floats(vec![1.0; 5]).to_value(), None);
    for value in [
        Value::Bool(false),
        Value::Uint(7),
        Value::Float(0.25),
        Value::UVec2(UVec2::new(1, 2)),
        Value::UVec3(UVec3::new(1, 2, 3)),
        Value::Vec2(Vec2::new(1.0, 2.0)),
        Value::Vec3(Vec3::new(1.0, 2.0, 3.0)),
        Value::Vec4(Vec4::new(1.0, 2.0, 3.0, 4.0)),
    ] {
        assert_eq!(Val::from(value).to_value(), Some(value));
    }
    assert_eq!(Val::from(Value::Int(-3)), Val::Int(-3));
    assert_eq!(Val::from(Value::UVec4(glam::UVec4::new(1, 2, 3, 4))), Val::Ints(vec![1, 2, 3, 4]));
    assert_eq!(Val::from(Value::Mat4(glam::Mat4::IDENTITY)).noun(), "a vector of floats");
}

fn agree(ours: &Result<Val, Diagnostic>, theirs: &Told) -> bool {
    let same = |x: f64, y: f64| x == y || (x.is_nan() && y.is_nan());
    match (ours, theirs) {
        (Ok(Val::Bool(a)), Ok(N::Truth(b))) => a == b,
        (Ok(Val::Int(a)), Ok(N::Whole(b, true))) => i128::from(*a) == b[0],
        (Ok(Val::Float(a)), Ok(N::Real(b, true))) => same(*a, b[0]),
        (Ok(Val::Ints(a)), Ok(N::Whole(b, false))) => a.iter().map(|x| i128::from(*x)).eq(b.iter().copied()),
        (Ok(Val::Floats(a)), Ok(N::Real(b, false))) => a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same(*a, *b)),
        (Err(d), Err(why)) => d.message.contains(why),
        _ => false,
    }
}

const OPERATORS_OF_TWO: [&str; 13] = ["+", "-", "*", "/", "%", "==", "!=", "<", "<=", ">", ">=", "&&", "||"];

fn trees() -> impl Strategy<Value = Tree> {
    let leaf = prop_oneof![
        4 => (0i64..10).prop_map(Tree::Int),
        1 => prop_oneof![Just(i64::MAX), Just(1i64 << 40), Just(3_037_000_500)].prop_map(Tree::Int),
        2 => prop_oneof![Just(0.5), Just(2.0), Just(0.0), Just(1e300), Just(3.25)].prop_map(Tree::Float),
        4 => prop_oneof![Just("n"), Just("grid"), Just("eps"), Just("at"), Just("on"), Just("true"), Just("false"), Just("nobody")]
            .prop_map(Tree::Name),
    ];
    leaf.prop_recursive(5, 48, 3, |of| {
        let one = of.clone().prop_map(Box::new);
        let (a, b, c) = (one.clone(), one.clone(), one.clone());
        prop_oneof![
            6 => (prop::sample::select(&OPERATORS_OF_TWO[..]), one.clone(), one.clone()).prop_map(|(op, a, b)| Tree::Two(op, a, b)),
            2 => (one.clone(), 0usize..4).prop_map(|(a, i)| Tree::Part(a, i)),
            1 => one.clone().prop_map(Tree::Minus),
            1 => one.clone().prop_map(Tree::Not),
            1 => (a, b, c).prop_map(|(a, b, c)| Tree::Choose(a, b, c)),
            1 => (prop_oneof![Just("abs"), Just("log2")], of.clone()).prop_map(|(f, a)| Tree::Call(f, vec![a])),
            3 => (prop::sample::select(&["min", "max", "ceil_div", "pow", "vec2"][..]), of.clone(), of.clone())
                .prop_map(|(f, a, b)| Tree::Call(f, vec![a, b])),
            1 => (of.clone(), of.clone(), of).prop_map(|(a, b, c)| Tree::Call("vec3", vec![a, b, c])),
        ]
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 6000, ..ProptestConfig::default() })]

    #[test]
    fn what_is_read_is_what_was_meant(tree in trees()) {
        let text = tree.text(0);
        let (ours, theirs) = (eval(&text), tree.value());
        prop_assert!(agree(&ours, &theirs), "{text}\ngives {ours:?}\nand is {theirs:?}");
    }
}
