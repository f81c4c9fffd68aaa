//! Lists the elements of a description of FMI 2.0 with their attributes and children, by its section 2.2.

use super::table::Row;

/// Attributes are `name:type`, with `!` for those that must be there; children come in this order, `Name=Row` where another element has
/// the same name.
#[rustfmt::skip]
pub(super) const ROWS: &[Row] = &[
    Row("fmiModelDescription",
        "fmiVersion:2.0! modelName:text! guid:text! description:text author:text version:text copyright:text license:text \
         generationTool:text generationDateAndTime:date variableNamingConvention:(flat|structured) numberOfEventIndicators:u32",
        "(ModelExchange|CoSimulation)* UnitDefinitions? TypeDefinitions? LogCategories? DefaultExperiment? \
         VendorAnnotations=Annotations? ModelVariables ModelStructure"),
    Row("ModelExchange",
        "modelIdentifier:text! needsExecutionTool:bool completedIntegratorStepNotNeeded:bool \
         canBeInstantiatedOnlyOncePerProcess:bool canNotUseMemoryManagementFunctions:bool canGetAndSetFMUstate:bool \
         canSerializeFMUstate:bool providesDirectionalDerivative:bool",
        "SourceFiles?"),
    Row("CoSimulation",
        "modelIdentifier:text! needsExecutionTool:bool canHandleVariableCommunicationStepSize:bool canInterpolateInputs:bool \
         maxOutputDerivativeOrder:u32 canRunAsynchronuously:bool canBeInstantiatedOnlyOncePerProcess:bool \
         canNotUseMemoryManagementFunctions:bool canGetAndSetFMUstate:bool canSerializeFMUstate:bool \
         providesDirectionalDerivative:bool",
        "SourceFiles?"),
    Row("SourceFiles", "", "File+"),
    Row("File", "name:text!", ""),
    Row("UnitDefinitions", "unique", "Unit+"),
    Row("Unit", "name:text!", "BaseUnit? DisplayUnit*"),
    Row("BaseUnit", "kg:i32 m:i32 s:i32 A:i32 K:i32 mol:i32 cd:i32 rad:i32 factor:real offset:real", ""),
    Row("DisplayUnit", "name:text! factor:real offset:real", ""),
    Row("TypeDefinitions", "unique", "SimpleType+"),
    Row("SimpleType", "name:text! description:text",
        "(Real=RealType|Integer=IntegerType|Boolean=Open|String=Open|Enumeration=EnumerationType)"),
    Row("RealType",
        "quantity:text unit:text displayUnit:text relativeQuantity:bool min:real max:real nominal:real unbounded:bool", ""),
    Row("IntegerType", "quantity:text min:i32 max:i32", ""),
    Row("EnumerationType", "unique quantity:text", "Item+"),
    Row("Item", "name:text! value:i32! description:text", ""),
    Row("LogCategories", "unique", "Category+"),
    Row("Category", "name:text! description:text", ""),
    Row("DefaultExperiment", "startTime:real stopTime:real tolerance:real stepSize:real", ""),
    Row("Annotations", "", "Tool+"),
    Row("Tool", "name:text!", "open"),
    Row("Open", "open", "open"),
    Row("ModelVariables", "unique", "ScalarVariable+"),
    Row("ScalarVariable",
        "name:text! valueReference:u32! description:text \
         causality:(parameter|calculatedParameter|input|output|local|independent) \
         variability:(constant|fixed|tunable|discrete|continuous) initial:(exact|approx|calculated) \
         canHandleMultipleSetPerTimeInstant:bool",
        "(Real|Integer|Boolean|String|Enumeration) Annotations?"),
    Row("Real",
        "declaredType:text quantity:text unit:text displayUnit:text relativeQuantity:bool min:real max:real nominal:real \
         unbounded:bool start:real derivative:u32 reinit:bool", ""),
    Row("Integer", "declaredType:text quantity:text min:i32 max:i32 start:i32", ""),
    Row("Boolean", "declaredType:text start:bool", ""),
    Row("String", "declaredType:text start:text", ""),
    Row("Enumeration", "declaredType:text! quantity:text min:i32 max:i32 start:i32", ""),
    Row("ModelStructure", "", "Outputs? Derivatives=Outputs? InitialUnknowns=Outputs?"),
    Row("Outputs", "", "Unknown+"),
    Row("Unknown",
        "index:u32! dependencies:[u32] dependenciesKind:[(dependent|constant|fixed|tunable|discrete)]", ""),
];
