//! Lists the elements of a description of FMI 2.0 with their attributes and children, by its section 2.2.

use super::table::ElementRow;

/// Attributes are `name:type`, with `!` for those that must be there; children come in this order, `Name=Row` where another element has
/// the same name.
#[rustfmt::skip]
pub(super) const ROWS: &[ElementRow] = &[
    ElementRow("fmiModelDescription",
        "fmiVersion:2.0! modelName:text! guid:text! description:text author:text version:text copyright:text license:text \
         generationTool:text generationDateAndTime:date variableNamingConvention:(flat|structured) numberOfEventIndicators:u32",
        "(ModelExchange|CoSimulation)* UnitDefinitions? TypeDefinitions? LogCategories? DefaultExperiment? \
         VendorAnnotations=Annotations? ModelVariables ModelStructure"),
    ElementRow("ModelExchange",
        "modelIdentifier:text! needsExecutionTool:bool completedIntegratorStepNotNeeded:bool \
         canBeInstantiatedOnlyOncePerProcess:bool canNotUseMemoryManagementFunctions:bool canGetAndSetFMUstate:bool \
         canSerializeFMUstate:bool providesDirectionalDerivative:bool",
        "SourceFiles?"),
    ElementRow("CoSimulation",
        "modelIdentifier:text! needsExecutionTool:bool canHandleVariableCommunicationStepSize:bool canInterpolateInputs:bool \
         maxOutputDerivativeOrder:u32 canRunAsynchronuously:bool canBeInstantiatedOnlyOncePerProcess:bool \
         canNotUseMemoryManagementFunctions:bool canGetAndSetFMUstate:bool canSerializeFMUstate:bool \
         providesDirectionalDerivative:bool",
        "SourceFiles?"),
    ElementRow("SourceFiles", "", "File+"),
    ElementRow("File", "name:text!", ""),
    ElementRow("UnitDefinitions", "unique", "Unit+"),
    ElementRow("Unit", "name:text!", "BaseUnit? DisplayUnit*"),
    ElementRow("BaseUnit", "kg:i32 m:i32 s:i32 A:i32 K:i32 mol:i32 cd:i32 rad:i32 factor:real offset:real", ""),
    ElementRow("DisplayUnit", "name:text! factor:real offset:real", ""),
    ElementRow("TypeDefinitions", "unique", "SimpleType+"),
    ElementRow("SimpleType", "name:text! description:text",
        "(Real=RealType|Integer=IntegerType|Boolean=Open|String=Open|Enumeration=EnumerationType)"),
    ElementRow("RealType",
        "quantity:text unit:text displayUnit:text relativeQuantity:bool min:real max:real nominal:real unbounded:bool", ""),
    ElementRow("IntegerType", "quantity:text min:i32 max:i32", ""),
    ElementRow("EnumerationType", "unique quantity:text", "Item+"),
    ElementRow("Item", "name:text! value:i32! description:text", ""),
    ElementRow("LogCategories", "unique", "Category+"),
    ElementRow("Category", "name:text! description:text", ""),
    ElementRow("DefaultExperiment", "startTime:real stopTime:real tolerance:real stepSize:real", ""),
    ElementRow("Annotations", "", "Tool+"),
    ElementRow("Tool", "name:text!", "open"),
    ElementRow("Open", "open", "open"),
    ElementRow("ModelVariables", "unique", "ScalarVariable+"),
    ElementRow("ScalarVariable",
        "name:text! valueReference:u32! description:text \
         causality:(parameter|calculatedParameter|input|output|local|independent) \
         variability:(constant|fixed|tunable|discrete|continuous) initial:(exact|approx|calculated) \
         canHandleMultipleSetPerTimeInstant:bool",
        "(Real|Integer|Boolean|String|Enumeration) Annotations?"),
    ElementRow("Real",
        "declaredType:text quantity:text unit:text displayUnit:text relativeQuantity:bool min:real max:real nominal:real \
         unbounded:bool start:real derivative:u32 reinit:bool", ""),
    ElementRow("Integer", "declaredType:text quantity:text min:i32 max:i32 start:i32", ""),
    ElementRow("Boolean", "declaredType:text start:bool", ""),
    ElementRow("String", "declaredType:text start:text", ""),
    ElementRow("Enumeration", "declaredType:text! quantity:text min:i32 max:i32 start:i32", ""),
    ElementRow("ModelStructure", "", "Outputs? Derivatives=Outputs? InitialUnknowns=Outputs?"),
    ElementRow("Outputs", "", "Unknown+"),
    ElementRow("Unknown",
        "index:u32! dependencies:[u32] dependenciesKind:[(dependent|constant|fixed|tunable|discrete)]", ""),
];
