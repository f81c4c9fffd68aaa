//! What tries damaged roads of OpenDRIVE and OpenCRG.

use std::path::Path;

use damage::FuzzTarget;
use track_file::read_road_file;

pub const TARGET: FuzzTarget = FuzzTarget {
    name: "roads",
    corpus: concat!(env!("CARGO_MANIFEST_DIR"), "/../track-file/tests/corpus/roads"),
    sound,
    words: &[
        "<road id=\"2\" length=\"1e9\" junction=\"-1\">",
        "<laneSection s=\"1e-9\">",
        "<lane id=\"-1\" type=\"driving\">",
        "<width sOffset=\"0\" a=\"-4\" b=\"0\" c=\"0\" d=\"1e6\"/>",
        "<geometry s=\"0\" x=\"0\" y=\"0\" hdg=\"0\" length=\"1e5\"><line/></geometry>",
        "<spiral curvStart=\"0\" curvEnd=\"9\"/>",
        "<arc curvature=\"1e12\"/>",
        "<superelevation s=\"0\" a=\"1.6\" b=\"0\" c=\"0\" d=\"0\"/>",
        "<predecessor id=\"-1\"/>",
        "<successor elementType=\"road\" elementId=\"1\" contactPoint=\"end\"/>",
        "junction=\"3\"",
        "REFERENCE_LINE_INCREMENT = 1e-12",
        "REFERENCE_LINE_END_U = 1e12",
        "LONG_SECTION_V_LEFT = 0",
        "#:KRBI",
        "D:reference line phi,rad",
        "$$$$",
        "**********",
        "NaN",
    ],
    own: None,
    attempt,
};

/// Two roads, one behind the other, with every shape of a line, heights and banks, and lanes that change their width.
const ROADS: &str = r#"<OpenDRIVE><header revMajor="1" revMinor="6"/>
<road id="1" length="60" junction="-1">
<link><successor elementType="road" elementId="2" contactPoint="start"/></link>
<planView>
<geometry s="0" x="0" y="0" hdg="0" length="20"><line/></geometry>
<geometry s="20" x="20" y="0" hdg="0" length="20"><spiral curvStart="0" curvEnd="0.02"/></geometry>
<geometry s="40" x="39.9" y="1.3" hdg="0.2" length="20"><arc curvature="0.02"/></geometry>
</planView>
<elevationProfile><elevation s="0" a="2" b="0.05" c="0" d="0"/></elevationProfile>
<lateralProfile><superelevation s="0" a="0.02" b="0.001" c="0" d="0"/></lateralProfile>
<lanes><laneOffset s="0" a="0.5" b="0" c="0" d="0"/>
<laneSection s="0"><left><lane id="1" type="driving"><width sOffset="0" a="3" b="0.01" c="0" d="0"/></lane></left>
<center><lane id="0" type="none"/></center>
<right><lane id="-1" type="driving"><link><successor id="-1"/></link><width sOffset="0" a="4" b="0" c="0" d="0"/></lane></right></laneSection>
<laneSection s="30"><center><lane id="0" type="none"/></center>
<right><lane id="-1" type="driving"><link><predecessor id="-1"/><successor id="-1"/></link><width sOffset="0" a="4" b="0" c="0" d="0"/></lane>
<lane id="-2" type="shoulder"><width sOffset="0" a="1" b="0" c="0" d="0"/></lane></right></laneSection></lanes></road>
<road id="2" length="40" junction="-1">
<link><predecessor elementType="road" elementId="1" contactPoint="end"/></link>
<planView>
<geometry s="0" x="57.5" y="9" hdg="0.6" length="20"><poly3 a="0" b="0" c="0.001" d="0"/></geometry>
<geometry s="20" x="74" y="20" hdg="0.7" length="20"><paramPoly3 pRange="arcLength" aU="0" bU="1" cU="0" dU="0" aV="0" bV="0" cV="0.01" dV="0"/></geometry>
</planView>
<lanes><laneSection s="0"><center><lane id="0" type="none"/></center>
<right><lane id="-1" type="driving"><link><predecessor id="-1"/><successor id="-1"/></link><width sOffset="0" a="4" b="0" c="0" d="0"/></lane></right>
</laneSection></lanes></road></OpenDRIVE>
"#;

/// A surface with a reference line that bends, and a hole.
const SURFACE: &str = "$ROAD_CRG\nREFERENCE_LINE_INCREMENT = 1.0\nLONG_SECTION_V_RIGHT = -3.0\nLONG_SECTION_V_INCREMENT = 3.0\n$\n\
                       $KD_Definition\n#:LRFI\nD:reference line phi,rad\nD:long section 1,m\nD:long section 2,m\nD:long section 3,m\n$\n$$$$\n";

fn sound() -> Vec<Vec<u8>> {
    let rows = (0..30).map(|i| {
        format!(
            " {:.7} 0.1000000 0.0000000 {}\n",
            0.01 * f64::from(i),
            if i == 9 { "*********" } else { "0.2000000" }
        )
    });
    vec![ROADS.as_bytes().to_vec(), (SURFACE.to_owned() + &rows.collect::<String>()).into_bytes()]
}

fn attempt(bytes: &[u8], folder: &Path) -> bool {
    let name = if bytes.first() == Some(&b'$') { "surface.crg" } else { "roads.xodr" };
    let path = folder.join(name);
    std::fs::write(&path, bytes).expect("a file");
    let mut taken = false;
    for roads in [&[][..], &["1".to_owned(), "2".to_owned()]] {
        let Ok(track) = read_road_file(&path, roads) else { continue };
        assert!(track.survey.points.iter().flatten().all(|it| it.is_finite()));
        assert!(track.survey.widths.iter().flatten().flatten().all(|it| *it >= 0.0));
        taken = true;
    }
    taken
}
