//! Lists the elements of a description of FMI 3.0 with their attributes and children, by its section 2.4.

use super::table::ElementRow;

/// As those of FMI 2.0; `&Row` in a list of attributes stands for those of another row, and `+open` for any other attribute.
#[rustfmt::skip]
pub(super) const ROWS: &[ElementRow] = &[
    ElementRow("fmiModelDescription",
        "fmiVersion:3.0! modelName:text! instantiationToken:text! description:text author:text version:text copyright:text \
         license:text generationTool:text generationDateAndTime:date variableNamingConvention:(flat|structured)",
        "ModelExchange? CoSimulation? ScheduledExecution? UnitDefinitions? TypeDefinitions? LogCategories? DefaultExperiment? \
         ModelVariables ModelStructure Annotations?"),
    ElementRow("Interface",
        "modelIdentifier:text! needsExecutionTool:bool canBeInstantiatedOnlyOncePerProcess:bool canGetAndSetFMUState:bool \
         canSerializeFMUState:bool providesDirectionalDerivatives:bool providesAdjointDerivatives:bool \
         providesPerElementDependencies:bool +open", "Annotations?"),
    ElementRow("ModelExchange", "&Interface needsCompletedIntegratorStep:bool providesEvaluateDiscreteStates:bool", "Annotations?"),
    ElementRow("CoSimulation",
        "&Interface canHandleVariableCommunicationStepSize:bool fixedInternalStepSize:real maxOutputDerivativeOrder:u32 \
         recommendedIntermediateInputSmoothness:i32 providesIntermediateUpdate:bool mightReturnEarlyFromDoStep:bool \
         canReturnEarlyAfterIntermediateUpdate:bool hasEventMode:bool providesEvaluateDiscreteStates:bool", "Annotations?"),
    ElementRow("ScheduledExecution", "&Interface", "Annotations?"),
    ElementRow("UnitDefinitions", "unique", "Unit+"),
    ElementRow("Unit", "name:text!", "BaseUnit? DisplayUnit* Annotations?"),
    ElementRow("BaseUnit", "kg:i32 m:i32 s:i32 A:i32 K:i32 mol:i32 cd:i32 rad:i32 factor:real offset:real", ""),
    ElementRow("DisplayUnit", "name:text! factor:real offset:real inverse:bool", "Annotations?"),
    ElementRow("TypeDefinitions", "unique",
        "(Float32Type|Float64Type|Int8Type|UInt8Type|Int16Type|UInt16Type|Int32Type|UInt32Type|Int64Type|UInt64Type|\
         BooleanType=Type|StringType=Type|BinaryType|EnumerationType|ClockType)+"),
    ElementRow("Type", "name:text! description:text", "Annotations?"),
    ElementRow("RealType", "&Type quantity:text unit:text displayUnit:text relativeQuantity:bool unbounded:bool", "Annotations?"),
    ElementRow("Float32Type", "&RealType min:real max:real nominal:real", "Annotations?"),
    ElementRow("Float64Type", "&RealType min:real max:real nominal:real", "Annotations?"),
    ElementRow("Int8Type", "&Type quantity:text min:i8 max:i8", "Annotations?"),
    ElementRow("UInt8Type", "&Type quantity:text min:u8 max:u8", "Annotations?"),
    ElementRow("Int16Type", "&Type quantity:text min:i16 max:i16", "Annotations?"),
    ElementRow("UInt16Type", "&Type quantity:text min:u16 max:u16", "Annotations?"),
    ElementRow("Int32Type", "&Type quantity:text min:i32 max:i32", "Annotations?"),
    ElementRow("UInt32Type", "&Type quantity:text min:u32 max:u32", "Annotations?"),
    ElementRow("Int64Type", "&Type quantity:text min:i64 max:i64", "Annotations?"),
    ElementRow("UInt64Type", "&Type quantity:text min:u64 max:u64", "Annotations?"),
    ElementRow("BinaryType", "&Type mimeType:text maxSize:natural", "Annotations?"),
    ElementRow("EnumerationType", "unique &Type quantity:text min:i64 max:i64", "Annotations? Item+"),
    ElementRow("Item", "name:text! value:i64! description:text", "Annotations?"),
    ElementRow("ClockAttributes",
        "canBeDeactivated:bool priority:u32 intervalVariability:(constant|fixed|tunable|changing|countdown|triggered)! \
         intervalDecimal:real shiftDecimal:real supportsFraction:bool resolution:u64 intervalCounter:u64 shiftCounter:u64", ""),
    ElementRow("ClockType", "&Type &ClockAttributes", "Annotations?"),
    ElementRow("LogCategories", "unique", "Category+"),
    ElementRow("Category", "name:text! description:text", "Annotations?"),
    ElementRow("DefaultExperiment", "startTime:real stopTime:real tolerance:real stepSize:real", "Annotations?"),
    ElementRow("ModelVariables", "unique",
        "(Float32|Float64|Int8|UInt8|Int16|UInt16|Int32|UInt32|Int64|UInt64|Boolean|String|Binary|Enumeration|Clock)+"),
    ElementRow("Any",
        "name:text! valueReference:u32! description:text \
         causality:(parameter|calculatedParameter|input|output|local|independent|structuralParameter) \
         variability:(constant|fixed|tunable|discrete|continuous) canHandleMultipleSetPerTimeInstant:bool clocks:[u32]", ""),
    ElementRow("Sized", "&Any intermediateUpdate:bool previous:u32 initial:(exact|approx|calculated)", ""),
    ElementRow("Typed", "&Sized declaredType:text", ""),
    ElementRow("Float",
        "&Typed quantity:text unit:text displayUnit:text relativeQuantity:bool unbounded:bool derivative:u32 reinit:bool \
         min:real max:real nominal:real start:[real]", ""),
    ElementRow("Float32", "&Float", "Annotations? Dimension* Alias=FloatAlias*"),
    ElementRow("Float64", "&Float", "Annotations? Dimension* Alias=FloatAlias*"),
    ElementRow("Int8", "&Typed quantity:text min:i8 max:i8 start:[i8]", "Annotations? Dimension* Alias*"),
    ElementRow("UInt8", "&Typed quantity:text min:u8 max:u8 start:[u8]", "Annotations? Dimension* Alias*"),
    ElementRow("Int16", "&Typed quantity:text min:i16 max:i16 start:[i16]", "Annotations? Dimension* Alias*"),
    ElementRow("UInt16", "&Typed quantity:text min:u16 max:u16 start:[u16]", "Annotations? Dimension* Alias*"),
    ElementRow("Int32", "&Typed quantity:text min:i32 max:i32 start:[i32]", "Annotations? Dimension* Alias*"),
    ElementRow("UInt32", "&Typed quantity:text min:u32 max:u32 start:[u32]", "Annotations? Dimension* Alias*"),
    ElementRow("Int64", "&Typed quantity:text min:i64 max:i64 start:[i64]", "Annotations? Dimension* Alias*"),
    ElementRow("UInt64", "&Typed quantity:text min:u64 max:u64 start:[u64]", "Annotations? Dimension* Alias*"),
    ElementRow("Boolean", "&Typed start:[bool]", "Annotations? Dimension* Alias*"),
    ElementRow("String", "&Typed", "Annotations? Dimension* Start=Text* Alias*"),
    ElementRow("Binary", "&Typed mimeType:text maxSize:natural", "Annotations? Dimension* Start=Bytes* Alias*"),
    ElementRow("Enumeration", "&Sized declaredType:text! quantity:text min:i64 max:i64 start:[i64]", "Annotations? Dimension* Alias*"),
    ElementRow("Clock", "&Any declaredType:text &ClockAttributes", "Annotations? Alias*"),
    ElementRow("Dimension", "start:u64 valueReference:u32", ""),
    ElementRow("Text", "value:text", ""),
    ElementRow("Bytes", "value:bytes", ""),
    ElementRow("Alias", "name:text! description:text", ""),
    ElementRow("FloatAlias", "&Alias displayUnit:text", ""),
    ElementRow("ModelStructure", "",
        "Output=Unknown* ContinuousStateDerivative=Unknown* ClockedState=Unknown* InitialUnknown=Unknown* EventIndicator=Unknown*"),
    ElementRow("Unknown",
        "valueReference:u32! dependencies:[u32] dependenciesKind:[(dependent|constant|fixed|tunable|discrete)]", "Annotations?"),
    ElementRow("Annotations", "", "Annotation+"),
    ElementRow("Annotation", "type:text!", "open"),
];
