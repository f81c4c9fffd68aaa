/* Defines the types of functions and callbacks of FMI 3.0, for sources that come without this file. */
#ifndef fmi3FunctionTypes_h
#define fmi3FunctionTypes_h

#include "fmi3PlatformTypes.h"
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef enum {
    fmi3Independent,
    fmi3Constant,
    fmi3Fixed,
    fmi3Tunable,
    fmi3Discrete,
    fmi3Dependent
} fmi3DependencyKind;
typedef enum { fmi3IntervalNotYetKnown, fmi3IntervalUnchanged, fmi3IntervalChanged } fmi3IntervalQualifier;

typedef void (*fmi3LogMessageCallback)(
    fmi3InstanceEnvironment, fmi3Status, fmi3String category, fmi3String message);
typedef void (*fmi3ClockUpdateCallback)(fmi3InstanceEnvironment);
typedef void (*fmi3IntermediateUpdateCallback)(fmi3InstanceEnvironment, fmi3Float64 time,
    fmi3Boolean set_requested, fmi3Boolean get_allowed, fmi3Boolean step_finished, fmi3Boolean can_return_early,
    fmi3Boolean *return_requested, fmi3Float64 *return_time);
typedef void (*fmi3LockPreemptionCallback)(void);
typedef void (*fmi3UnlockPreemptionCallback)(void);

typedef const char *fmi3GetVersionTYPE(void);
typedef fmi3Status fmi3SetDebugLoggingTYPE(fmi3Instance, fmi3Boolean on, size_t, const fmi3String categories[]);
typedef fmi3Instance fmi3InstantiateModelExchangeTYPE(fmi3String name, fmi3String token, fmi3String resources,
    fmi3Boolean visible, fmi3Boolean logging, fmi3InstanceEnvironment, fmi3LogMessageCallback);
typedef fmi3Instance fmi3InstantiateCoSimulationTYPE(fmi3String name, fmi3String token, fmi3String resources,
    fmi3Boolean visible, fmi3Boolean logging, fmi3Boolean event_mode, fmi3Boolean early_return,
    const fmi3ValueReference intermediate[], size_t, fmi3InstanceEnvironment, fmi3LogMessageCallback,
    fmi3IntermediateUpdateCallback);
typedef fmi3Instance fmi3InstantiateScheduledExecutionTYPE(fmi3String name, fmi3String token, fmi3String resources,
    fmi3Boolean visible, fmi3Boolean logging, fmi3InstanceEnvironment, fmi3LogMessageCallback,
    fmi3ClockUpdateCallback, fmi3LockPreemptionCallback, fmi3UnlockPreemptionCallback);
typedef void fmi3FreeInstanceTYPE(fmi3Instance);
typedef fmi3Status fmi3EnterInitializationModeTYPE(fmi3Instance, fmi3Boolean has_tolerance, fmi3Float64 tolerance,
    fmi3Float64 start, fmi3Boolean has_stop, fmi3Float64 stop);

/* Functions that change the mode and nothing else. */
#define FMI3_MODE_TYPE(name) typedef fmi3Status name##TYPE(fmi3Instance);
FMI3_MODE_TYPE(fmi3ExitInitializationMode)
FMI3_MODE_TYPE(fmi3EnterEventMode)
FMI3_MODE_TYPE(fmi3Terminate)
FMI3_MODE_TYPE(fmi3Reset)
FMI3_MODE_TYPE(fmi3EnterConfigurationMode)
FMI3_MODE_TYPE(fmi3ExitConfigurationMode)
FMI3_MODE_TYPE(fmi3EvaluateDiscreteStates)
FMI3_MODE_TYPE(fmi3EnterContinuousTimeMode)
FMI3_MODE_TYPE(fmi3EnterStepMode)
#undef FMI3_MODE_TYPE

#define FMI3_VALUE_TYPES(type) \
    typedef fmi3Status fmi3Get##type##TYPE( \
        fmi3Instance, const fmi3ValueReference[], size_t, fmi3##type[], size_t); \
    typedef fmi3Status fmi3Set##type##TYPE( \
        fmi3Instance, const fmi3ValueReference[], size_t, const fmi3##type[], size_t);
FMI3_VALUE_TYPES(Float32)
FMI3_VALUE_TYPES(Float64)
FMI3_VALUE_TYPES(Int8)
FMI3_VALUE_TYPES(UInt8)
FMI3_VALUE_TYPES(Int16)
FMI3_VALUE_TYPES(UInt16)
FMI3_VALUE_TYPES(Int32)
FMI3_VALUE_TYPES(UInt32)
FMI3_VALUE_TYPES(Int64)
FMI3_VALUE_TYPES(UInt64)
FMI3_VALUE_TYPES(Boolean)
FMI3_VALUE_TYPES(String)
#undef FMI3_VALUE_TYPES
typedef fmi3Status fmi3GetBinaryTYPE(
    fmi3Instance, const fmi3ValueReference[], size_t, size_t sizes[], fmi3Binary[], size_t);
typedef fmi3Status fmi3SetBinaryTYPE(
    fmi3Instance, const fmi3ValueReference[], size_t, const size_t sizes[], const fmi3Binary[], size_t);
typedef fmi3Status fmi3GetClockTYPE(fmi3Instance, const fmi3ValueReference[], size_t, fmi3Clock[]);
typedef fmi3Status fmi3SetClockTYPE(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3Clock[]);

typedef fmi3Status fmi3GetNumberOfVariableDependenciesTYPE(fmi3Instance, fmi3ValueReference, size_t *);
typedef fmi3Status fmi3GetVariableDependenciesTYPE(fmi3Instance, fmi3ValueReference dependent,
    size_t dependent_elements[], fmi3ValueReference independents[], size_t independent_elements[],
    fmi3DependencyKind[], size_t);

typedef fmi3Status fmi3GetFMUStateTYPE(fmi3Instance, fmi3FMUState *);
typedef fmi3Status fmi3SetFMUStateTYPE(fmi3Instance, fmi3FMUState);
typedef fmi3Status fmi3FreeFMUStateTYPE(fmi3Instance, fmi3FMUState *);
typedef fmi3Status fmi3SerializedFMUStateSizeTYPE(fmi3Instance, fmi3FMUState, size_t *);
typedef fmi3Status fmi3SerializeFMUStateTYPE(fmi3Instance, fmi3FMUState, fmi3Byte[], size_t);
typedef fmi3Status fmi3DeserializeFMUStateTYPE(fmi3Instance, const fmi3Byte[], size_t, fmi3FMUState *);

typedef fmi3Status fmi3GetDirectionalDerivativeTYPE(fmi3Instance, const fmi3ValueReference unknowns[], size_t,
    const fmi3ValueReference knowns[], size_t, const fmi3Float64 seed[], size_t, fmi3Float64 sensitivity[], size_t);
typedef fmi3GetDirectionalDerivativeTYPE fmi3GetAdjointDerivativeTYPE;

typedef fmi3Status fmi3GetIntervalDecimalTYPE(
    fmi3Instance, const fmi3ValueReference[], size_t, fmi3Float64 intervals[], fmi3IntervalQualifier[]);
typedef fmi3Status fmi3GetIntervalFractionTYPE(fmi3Instance, const fmi3ValueReference[], size_t,
    fmi3UInt64 counters[], fmi3UInt64 resolutions[], fmi3IntervalQualifier[]);
typedef fmi3Status fmi3GetShiftDecimalTYPE(fmi3Instance, const fmi3ValueReference[], size_t, fmi3Float64 shifts[]);
typedef fmi3Status fmi3GetShiftFractionTYPE(
    fmi3Instance, const fmi3ValueReference[], size_t, fmi3UInt64 counters[], fmi3UInt64 resolutions[]);
typedef fmi3Status fmi3SetIntervalDecimalTYPE(
    fmi3Instance, const fmi3ValueReference[], size_t, const fmi3Float64 intervals[]);
typedef fmi3SetIntervalDecimalTYPE fmi3SetShiftDecimalTYPE;
typedef fmi3Status fmi3SetIntervalFractionTYPE(
    fmi3Instance, const fmi3ValueReference[], size_t, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]);
typedef fmi3SetIntervalFractionTYPE fmi3SetShiftFractionTYPE;

typedef fmi3Status fmi3UpdateDiscreteStatesTYPE(fmi3Instance, fmi3Boolean *update_again, fmi3Boolean *terminate,
    fmi3Boolean *nominals_changed, fmi3Boolean *states_changed, fmi3Boolean *has_next_event, fmi3Float64 *next_event);
typedef fmi3Status fmi3CompletedIntegratorStepTYPE(
    fmi3Instance, fmi3Boolean no_going_back, fmi3Boolean *event_mode, fmi3Boolean *terminate);
typedef fmi3Status fmi3SetTimeTYPE(fmi3Instance, fmi3Float64);
typedef fmi3Status fmi3SetContinuousStatesTYPE(fmi3Instance, const fmi3Float64[], size_t);
typedef fmi3Status fmi3GetContinuousStateDerivativesTYPE(fmi3Instance, fmi3Float64[], size_t);
typedef fmi3Status fmi3GetEventIndicatorsTYPE(fmi3Instance, fmi3Float64[], size_t);
typedef fmi3Status fmi3GetContinuousStatesTYPE(fmi3Instance, fmi3Float64[], size_t);
typedef fmi3Status fmi3GetNominalsOfContinuousStatesTYPE(fmi3Instance, fmi3Float64[], size_t);
typedef fmi3Status fmi3GetNumberOfEventIndicatorsTYPE(fmi3Instance, size_t *);
typedef fmi3Status fmi3GetNumberOfContinuousStatesTYPE(fmi3Instance, size_t *);
typedef fmi3Status fmi3GetOutputDerivativesTYPE(
    fmi3Instance, const fmi3ValueReference[], size_t, const fmi3Int32 orders[], fmi3Float64[], size_t);
typedef fmi3Status fmi3DoStepTYPE(fmi3Instance, fmi3Float64 time, fmi3Float64 step, fmi3Boolean no_going_back,
    fmi3Boolean *event_needed, fmi3Boolean *terminate, fmi3Boolean *early_return, fmi3Float64 *reached);
typedef fmi3Status fmi3ActivateModelPartitionTYPE(fmi3Instance, fmi3ValueReference clock, fmi3Float64 time);

#ifdef __cplusplus
}
#endif

#endif
