//! Reads messages of all forms to known answers.

#[path = "support/made.rs"]
mod made;

use made::Cdr;
use ros_bag::{
    BagDatabase, DefinitionLanguage, Error, MessageDefinition, MessageEncoding, MessageValue, PathError,
};

fn definition(text: &str) -> MessageDefinition {
    MessageDefinition::parse("demo/msg/Wheels", DefinitionLanguage::Msg, text).expect(text)
}

/// The value at a path.
fn at(definition: &MessageDefinition, message: &MessageValue, path: &str) -> MessageValue {
    let way = definition.resolve_field_path(path).expect(path);
    message.get_at_path(&way.steps).unwrap_or_else(|| panic!("no {path} in {message:?}")).clone()
}

#[test]
fn fields_of_messages_in_messages_and_lists_are_found_by_their_paths() {
    let definition = definition(made::WHEELS);
    let message = definition.decode_message(MessageEncoding::Cdr, &made::wheels(7)).expect("it fits");
    for (path, value) in [
        ("header.stamp.sec", MessageValue::Integer(7)),
        ("header.frame_id", MessageValue::Text("base".into())),
        ("wheels.0.side", MessageValue::Integer(1)),
        ("wheels.1.side", MessageValue::Integer(-2)),
        ("wheels.1.slip", MessageValue::Real(0.25)),
        ("speed.1", MessageValue::Real(7.0)),
        ("name", MessageValue::Text("wet".into())),
    ] {
        assert_eq!(at(&definition, &message, path), value, "{path}");
    }
    let rows = definition.message_rows(&message);
    assert_eq!(definition.header_stamp(&rows[0]), Some(7_500_000_000));
    let leaves = definition.list_fields(Some(&rows[0])).leaves;
    assert_eq!(leaves.len(), 10, "{leaves:?}");
    let other = |text: &str| Err(PathError::Other(text.to_owned()));
    assert_eq!(definition.resolve_field_path("wheels"), other("a list: add an index, as in `.0`"));
    assert_eq!(definition.resolve_field_path("header"), other("a message"));
    for path in ["speed.2", "speed.x", "wheel.0", "name.x", ""] {
        assert_eq!(definition.resolve_field_path(path), Err(PathError::Missing), "{path}");
    }
    let cut = definition.decode_message(MessageEncoding::Cdr, &made::wheels(7)[..60]).expect_err("it is cut");
    assert!(cut.starts_with("it ends too early"), "{cut}");
}

#[test]
fn both_byte_orders_and_both_versions_have_the_same_values() {
    let text = "uint8 small\nint64 large\nuint16[3] fixed\nInner[] list\nstring[2] words\nwstring wide\nfloat32 last\n\
                ========================================\nMSG: demo/Inner\nbool on\nfloat64 x\n";
    let definition = definition(text);
    for kind in [0, 1, 6, 7, 8, 9] {
        let (lists, structures) = (kind >= 6, kind >= 8);
        let mut cdr = Cdr::new(kind);
        let delimiter = |cdr: &mut Cdr, wanted: bool| {
            if wanted {
                cdr.count(99);
            }
        };
        delimiter(&mut cdr, structures);
        cdr.put([200u8]).put(i64::MIN.to_le_bytes());
        for number in [1u16, 2, 65535] {
            cdr.put(number.to_le_bytes());
        }
        delimiter(&mut cdr, lists);
        cdr.count(2);
        for x in [1.5, -2.5] {
            delimiter(&mut cdr, structures);
            cdr.put([1u8]).double(x);
        }
        delimiter(&mut cdr, lists);
        cdr.text("a").text("").count(2);
        cdr.put(0x00e4u32.to_le_bytes()).put(0x03c0u32.to_le_bytes()).put(0.5f32.to_le_bytes());
        let message = definition.decode_message(MessageEncoding::Cdr, &cdr.bytes);
        let message = message.unwrap_or_else(|what| panic!("{kind}: {what}"));
        for (path, value) in [
            ("small", MessageValue::Integer(200)),
            ("large", MessageValue::Integer(i64::MIN.into())),
            ("fixed.2", MessageValue::Integer(65535)),
            ("list.1.on", MessageValue::Integer(1)),
            ("list.1.x", MessageValue::Real(-2.5)),
            ("words.0", MessageValue::Text("a".into())),
            ("wide", MessageValue::Text("äπ".into())),
            ("last", MessageValue::Real(0.5)),
        ] {
            assert_eq!(at(&definition, &message, path), value, "{kind} {path}");
        }
    }
    for (kind, name) in [(2, "PL_CDR)"), (3, "PL_CDR)"), (11, "PL_CDR2)"), (99, "begins with 00 63")] {
        let error = definition.decode_message(MessageEncoding::Cdr, &[0, kind, 0, 0, 0]).expect_err(name);
        assert!(error.contains(name), "{error}");
    }
}

#[test]
fn definitions_in_idl_have_modules_names_of_types_and_enumerations() {
    let definition =
        MessageDefinition::parse("demo/msg/Wheel", DefinitionLanguage::Idl, made::IDL).expect("IDL");
    let mut cdr = Cdr::new(1);
    cdr.double(1.5).double(2.5).count(1).count(1).put((-5i64).to_le_bytes());
    for byte in 0..6u8 {
        cdr.put([byte]);
    }
    cdr.text("fl");
    let message = definition.decode_message(MessageEncoding::Cdr, &cdr.bytes).expect("it fits");
    for (path, value) in [
        ("slip.1", MessageValue::Real(2.5)),
        ("side", MessageValue::Integer(1)),
        ("counts.0", MessageValue::Integer(-5)),
        ("raw.2.1", MessageValue::Integer(5)),
        ("name", MessageValue::Text("fl".into())),
    ] {
        assert_eq!(at(&definition, &message, path), value, "{path}");
    }
    for (text, says) in [
        ("module a { struct B { long x };", "expected `;` in line 1, found `}`"),
        ("struct Wheel { wchar x; };", "the type `wchar` cannot be read here"),
        ("union U switch (long) {};", "`union` cannot be read here"),
        ("module demo { module msg { struct Wheel { Wheel x; }; }; };", "contains itself"),
        ("module demo { module msg { struct Wheel { Tire x; }; }; };", "no definition of `demo/Tire`"),
        ("module demo { module msg { struct Wheel { long x[N]; }; }; };", "expected a number in line 1"),
        ("struct A { string x = \"", "has no end"),
    ] {
        let error =
            MessageDefinition::parse("demo/msg/Wheel", DefinitionLanguage::Idl, text).expect_err(text);
        assert!(error.contains(says), "{text}: {error}");
    }
}

#[test]
fn a_message_without_fields_has_a_byte() {
    let definition =
        definition("Empty nothing\nuint8 last\n========================================\nMSG: demo/Empty\n");
    let message = definition.decode_message(MessageEncoding::Cdr, &[0, 1, 0, 0, 9, 7]).expect("it fits");
    assert_eq!(at(&definition, &message, "last"), MessageValue::Integer(7));
    let empty = MessageDefinition::parse("demo/msg/Empty", DefinitionLanguage::Msg, "").expect("it is one");
    let message = empty.decode_message(MessageEncoding::Cdr, &[0, 1, 0, 0, 0]).expect("it fits");
    assert!(empty.list_fields(Some(&empty.message_rows(&message)[0])).leaves.is_empty());
    assert!(MessageDefinition::standard_message("demo/msg/Empty").is_err());
}

#[test]
fn messages_of_ros_1_have_no_gaps_between_fields_and_a_time_of_their_own() {
    let text = "Header header\nuint8 a\nfloat64 b\nstring c\nduration d\n========================================\n\
                MSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";
    let definition =
        MessageDefinition::parse("demo/Old", DefinitionLanguage::Msg1, text).expect("a definition");
    let mut bytes: Vec<u8> = [9u32, 12, 250_000_000, 1].iter().flat_map(|it| it.to_le_bytes()).collect();
    bytes.extend(b"m\x03");
    bytes.extend(1.5f64.to_le_bytes());
    bytes.extend([2, 0, 0, 0, b'x', 0, 255, 255, 255, 255, 1, 0, 0, 0]);
    let message = definition.decode_message(MessageEncoding::Ros1, &bytes).expect("it fits");
    assert_eq!(at(&definition, &message, "b"), MessageValue::Real(1.5));
    assert_eq!(at(&definition, &message, "c"), MessageValue::Text("x\0".into()));
    assert_eq!(at(&definition, &message, "d.secs"), MessageValue::Integer(-1));
    assert_eq!(definition.header_stamp(&definition.message_rows(&message)[0]), Some(12_250_000_000));
}

#[test]
fn lists_that_are_long_or_of_nothing_take_no_time() {
    let text = "Empty[4000000000] nothing\nuint8[] image\nstring[] words\nfloat64 last\n========================================\nMSG: demo/Empty\n";
    let ros1 = MessageDefinition::parse("demo/Old", DefinitionLanguage::Msg1, text).expect("a definition");
    let mut bytes = 300u32.to_le_bytes().to_vec();
    bytes.extend([7; 300]);
    bytes.extend([0; 4]);
    bytes.extend(2.5f64.to_le_bytes());
    let message = ros1.decode_message(MessageEncoding::Ros1, &bytes).expect("it fits");
    assert_eq!(at(&ros1, &message, "last"), MessageValue::Real(2.5));
    assert_eq!(message.get_at_path(&[1]), Some(&MessageValue::Long(300)));
    let listing = ros1.list_fields(Some(&ros1.message_rows(&message)[0]));
    assert!(listing.left_out.iter().any(|it| it == "`image`: a list of 300 elements"), "{listing:?}");
    // What a damaged message says of its lists is held against the bytes that are there.
    let cdr = definition("string[] words\n");
    let mut long = Cdr::new(1);
    let error = cdr.decode_message(MessageEncoding::Cdr, &long.count(u32::MAX).bytes).expect_err("it is cut");
    assert!(error.contains("expected a list of 4294967295 elements, found 0 bytes"), "{error}");
}

#[test]
fn bags_without_definitions_have_the_usual_messages() {
    let folder = tempfile::tempdir().expect("a folder");
    for defined in [true, false] {
        let path = folder.path().join(format!("bag #{defined}?.db3"));
        made::bag(&path, defined).expect("a bag");
        let bag = BagDatabase::open(&path).expect("it is read");
        let steer = bag.topics.iter().find(|it| it.name == "/steer").expect("a topic");
        assert_eq!((steer.language.as_str(), steer.kind.as_str()), ("", "std_msgs/msg/Float64"));
        let definition = MessageDefinition::standard_message(&steer.kind).expect("it is known");
        let mut found = Vec::new();
        let wanted = |topic| topic == steer.id;
        bag.visit_messages::<Error>(&wanted, &mut |_, time, data| {
            let message = definition.decode_message(MessageEncoding::Cdr, data).expect("it fits");
            found.push((time, at(&definition, &message, "data")));
            Ok(found.len() < 3)
        })
        .expect("they are read");
        let expected = [0.0, 0.1, 0.2].map(MessageValue::Real);
        assert_eq!(found.iter().map(|it| it.1.clone()).collect::<Vec<_>>(), expected);
        assert_eq!(found[2].0, 2_500_000_700);
        let beside = std::fs::read_dir(folder.path()).expect("a folder").count();
        assert_eq!(beside, if defined { 1 } else { 2 }, "nothing is written beside a bag");
    }
    let imu = MessageDefinition::standard_message("sensor_msgs/msg/Imu").expect("it is known");
    let other = [[0u8, 1, 0, 0].to_vec(), vec![0; 400]].concat();
    let error = imu.decode_message(MessageEncoding::Cdr, &other).expect_err("it is another one");
    assert!(error.contains("bytes are left over"), "{error}");
}
