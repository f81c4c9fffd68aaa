//! What tries damaged bags and damaged definitions.

use std::path::Path;

use damage::FuzzTarget;
use ros_bag::{BagDatabase, DefinitionLanguage, Error, MessageDefinition, MessageEncoding};

use super::made;

pub const TARGET: FuzzTarget = FuzzTarget {
    name: "bags",
    corpus: concat!(env!("CARGO_MANIFEST_DIR"), "/../ros-bag/tests/corpus/bags"),
    sound,
    words: &[
        "[]",
        "[<=3]",
        "[99999999999]",
        "float64",
        "string",
        "wstring<=2",
        "MSG: demo/Wheel\n",
        "demo/Wheels",
        "IDL: demo/msg/Wheel\n",
        "sequence<",
        "typedef",
        "module",
        "struct",
        "}",
        ";",
        "@verbatim(",
        "\"",
        "::",
        "\0\x06\0\0",
        "\0\x09\0\0",
        "\0\x03\0\0",
        "ros2idl",
    ],
    own: None,
    attempt,
};

fn sound() -> Vec<Vec<u8>> {
    let folder = tempfile::tempdir().expect("a folder");
    let bag = |name: &str, defined| {
        let path = folder.path().join(name);
        made::bag(&path, defined).expect("a bag");
        std::fs::read(path).expect("it is there")
    };
    vec![
        bag("a", true),
        bag("b", false),
        made::IDL.as_bytes().to_vec(),
        made::WHEELS.as_bytes().to_vec(),
        made::wheels(3),
    ]
}

fn attempt(bytes: &[u8], folder: &Path) -> bool {
    let text = String::from_utf8_lossy(bytes);
    let mut taken = false;
    for (name, language) in [
        ("demo/Wheel", DefinitionLanguage::Idl),
        ("demo/Wheels", DefinitionLanguage::Msg),
        ("demo/Wheels", DefinitionLanguage::Msg1),
    ] {
        let Ok(definition) = MessageDefinition::parse(name, language, &text) else { continue };
        read(&definition, &made::wheels(1));
        taken = true;
    }
    let wheels =
        MessageDefinition::parse("demo/Wheels", DefinitionLanguage::Msg, made::WHEELS).expect("it is sound");
    taken |= read(&wheels, bytes);
    let path = folder.join("bag.db3");
    std::fs::write(&path, bytes).expect("the folder is writable");
    let Ok(bag) = BagDatabase::open(&path) else { return taken };
    let definitions: Vec<_> = bag
        .topics
        .iter()
        .filter_map(|it| {
            let definition = match DefinitionLanguage::from_name(&it.language) {
                Some(language) => MessageDefinition::parse(&it.kind, language, &it.definition),
                None => MessageDefinition::standard_message(&it.kind),
            };
            Some((it.id, definition.ok()?))
        })
        .collect();
    bag.visit_messages::<Error>(&|_| true, &mut |topic, _, data| {
        let of = definitions.iter().find(|it| it.0 == topic);
        taken |= of.is_some_and(|(_, definition)| read(definition, data));
        Ok(true)
    })
    .is_ok()
}

/// Reads a message and all that it has.
fn read(definition: &MessageDefinition, data: &[u8]) -> bool {
    let mut taken = false;
    for encoding in [MessageEncoding::Cdr, MessageEncoding::Ros1] {
        let Ok(plain) = ros_bag::decompress_message(data) else { continue };
        let Ok(message) = definition.decode_message(encoding, &plain) else { continue };
        taken = true;
        for row in definition.message_rows(&message) {
            let _ = definition.header_stamp(&row);
            let listing = definition.list_fields(Some(&row));
            for leaf in listing.leaves {
                let way = definition.resolve_field_path(&leaf.path).expect(&leaf.path);
                assert_eq!(way.steps, leaf.steps, "{}", leaf.path);
                assert_eq!(definition.field_unit(&way), leaf.unit, "{}", leaf.path);
                assert!(row.value.get_at_path(&way.steps).is_some(), "{}", leaf.path);
            }
        }
    }
    let _ = definition.list_fields(None);
    taken
}
