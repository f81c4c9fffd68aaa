//! Lists the elements of a description of FMI 3.0 with their attributes and children, by its section 2.4.

use super::table::Row;

/// As those of FMI 2.0; `&Row` in a list of attributes stands for those of another row, and `+open` for any other attribute.
#[rustfmt::skip]
pub(super) const ROWS: &[Row] = &[
    Row("fmiModelDescription",
        "fmiVersion:3.0! modelName:text! instantiationToken:text! description:text author:text version:text copyright:text \
         license:text generationTool:text generationDateAndTime:date variableNamingConvention:(flat|structured)",
        "ModelExchange? CoSimulation? ScheduledExecution? UnitDefinitions? TypeDefinitions? LogCategories? DefaultExperiment? \
         ModelVariables ModelStructure Annotations?"),
    Row("Interface",
        "modelIdentifier:text! needsExecutionTool:bool canBeInstantiatedOnlyOncePerProcess:bool canGetAndSetFMUState:bool \
         canSerializeFMUState:bool providesDirectionalDerivatives:bool providesAdjointDerivatives:bool \
         providesPerElementDependencies:bool +open", "Annotations?"),
    Row("ModelExchange", "&Interface needsCompletedIntegratorStep:bool providesEvaluateDiscreteStates:bool", "Annotations?"),
    Row("CoSimulation",
        "&Interface canHandleVariableCommunicationStepSize:bool fixedInternalStepSize:real maxOutputDerivativeOrder:u32 \
         recommendedIntermediateInputSmoothness:i32 providesIntermediateUpdate:bool mightReturnEarlyFromDoStep:bool \
         canReturnEarlyAfterIntermediateUpdate:bool hasEventMode:bool providesEvaluateDiscreteStates:bool", "Annotations?"),
    Row("ScheduledExecution", "&Interface", "Annotations?"),
    Row("UnitDefinitions", "unique", "Unit+"),
    Row("Unit", "name:text!", "BaseUnit? DisplayUnit* Annotations?"),
    Row("BaseUnit", "kg:i32 m:i32 s:i32 A:i32 K:i32 mol:i32 cd:i32 rad:i32 factor:real offset:real", ""),
    Row("DisplayUnit", "name:text! factor:real offset:real inverse:bool", "Annotations?"),
    Row("TypeDefinitions", "unique",
        "(Float32Type|Float64Type|Int8Type|UInt8Type|Int16Type|UInt16Type|Int32Type|UInt32Type|Int64Type|UInt64Type|\
         BooleanType=Type|StringType=Type|BinaryType|EnumerationType|ClockType)+"),
    Row("Type", "name:text! description:text", "Annotations?"),
    Row("RealType", "&Type quantity:text unit:text displayUnit:text relativeQuantity:bool unbounded:bool", "Annotations?"),
    Row("Float32Type", "&RealType min:real max:real nominal:real", "Annotations?"),
    Row("Float64Type", "&RealType min:real max:real nominal:real", "Annotations?"),
    Row("Int8Type", "&Type quantity:text min:i8 max:i8", "Annotations?"),
    Row("UInt8Type", "&Type quantity:text min:u8 max:u8", "Annotations?"),
    Row("Int16Type", "&Type quantity:text min:i16 max:i16", "Annotations?"),
    Row("UInt16Type", "&Type quantity:text min:u16 max:u16", "Annotations?"),
    Row("Int32Type", "&Type quantity:text min:i32 max:i32", "Annotations?"),
    Row("UInt32Type", "&Type quantity:text min:u32 max:u32", "Annotations?"),
    Row("Int64Type", "&Type quantity:text min:i64 max:i64", "Annotations?"),
    Row("UInt64Type", "&Type quantity:text min:u64 max:u64", "Annotations?"),
    Row("BinaryType", "&Type mimeType:text maxSize:natural", "Annotations?"),
    Row("EnumerationType", "unique &Type quantity:text min:i64 max:i64", "Annotations? Item+"),
    Row("Item", "name:text! value:i64! description:text", "Annotations?"),
    Row("ClockAttributes",
        "canBeDeactivated:bool priority:u32 intervalVariability:(constant|fixed|tunable|changing|countdown|triggered)! \
         intervalDecimal:real shiftDecimal:real supportsFraction:bool resolution:u64 intervalCounter:u64 shiftCounter:u64", ""),
    Row("ClockType", "&Type &ClockAttributes", "Annotations?"),
    Row("LogCategories", "unique", "Category+"),
    Row("Category", "name:text! description:text", "Annotations?"),
    Row("DefaultExperiment", "startTime:real stopTime:real tolerance:real stepSize:real", "Annotations?"),
    Row("ModelVariables", "unique",
        "(Float32|Float64|Int8|UInt8|Int16|UInt16|Int32|UInt32|Int64|UInt64|Boolean|String|Binary|Enumeration|Clock)+"),
    Row("Any",
        "name:text! valueReference:u32! description:text \
         causality:(parameter|calculatedParameter|input|output|local|independent|structuralParameter) \
         variability:(constant|fixed|tunable|discrete|continuous) canHandleMultipleSetPerTimeInstant:bool clocks:[u32]", ""),
    Row("Sized", "&Any intermediateUpdate:bool previous:u32 initial:(exact|approx|calculated)", ""),
    Row("Typed", "&Sized declaredType:text", ""),
    Row("Float",
        "&Typed quantity:text unit:text displayUnit:text relativeQuantity:bool unbounded:bool derivative:u32 reinit:bool \
         min:real max:real nominal:real start:[real]", ""),
    Row("Float32", "&Float", "Annotations? Dimension* Alias=FloatAlias*"),
    Row("Float64", "&Float", "Annotations? Dimension* Alias=FloatAlias*"),
    Row("Int8", "&Typed quantity:text min:i8 max:i8 start:[i8]", "Annotations? Dimension* Alias*"),
    Row("UInt8", "&Typed quantity:text min:u8 max:u8 start:[u8]", "Annotations? Dimension* Alias*"),
    Row("Int16", "&Typed quantity:text min:i16 max:i16 start:[i16]", "Annotations? Dimension* Alias*"),
    Row("UInt16", "&Typed quantity:text min:u16 max:u16 start:[u16]", "Annotations? Dimension* Alias*"),
    Row("Int32", "&Typed quantity:text min:i32 max:i32 start:[i32]", "Annotations? Dimension* Alias*"),
    Row("UInt32", "&Typed quantity:text min:u32 max:u32 start:[u32]", "Annotations? Dimension* Alias*"),
    Row("Int64", "&Typed quantity:text min:i64 max:i64 start:[i64]", "Annotations? Dimension* Alias*"),
    Row("UInt64", "&Typed quantity:text min:u64 max:u64 start:[u64]", "Annotations? Dimension* Alias*"),
    Row("Boolean", "&Typed start:[bool]", "Annotations? Dimension* Alias*"),
    Row("String", "&Typed", "Annotations? Dimension* Start=Text* Alias*"),
    Row("Binary", "&Typed mimeType:text maxSize:natural", "Annotations? Dimension* Start=Bytes* Alias*"),
    Row("Enumeration", "&Sized declaredType:text! quantity:text min:i64 max:i64 start:[i64]", "Annotations? Dimension* Alias*"),
    Row("Clock", "&Any declaredType:text &ClockAttributes", "Annotations? Alias*"),
    Row("Dimension", "start:u64 valueReference:u32", ""),
    Row("Text", "value:text", ""),
    Row("Bytes", "value:bytes", ""),
    Row("Alias", "name:text! description:text", ""),
    Row("FloatAlias", "&Alias displayUnit:text", ""),
    Row("ModelStructure", "",
        "Output=Unknown* ContinuousStateDerivative=Unknown* ClockedState=Unknown* InitialUnknown=Unknown* EventIndicator=Unknown*"),
    Row("Unknown",
        "valueReference:u32! dependencies:[u32] dependenciesKind:[(dependent|constant|fixed|tunable|discrete)]", "Annotations?"),
    Row("Annotations", "", "Annotation+"),
    Row("Annotation", "type:text!", "open"),
];
