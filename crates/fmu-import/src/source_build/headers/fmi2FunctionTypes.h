/* Defines the types of functions, callbacks and states of FMI 2.0, for sources that come without this file. */
#ifndef fmi2FunctionTypes_h
#define fmi2FunctionTypes_h

#include "fmi2TypesPlatform.h"
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;

typedef void (*fmi2CallbackLogger)(
    fmi2ComponentEnvironment, fmi2String instance, fmi2Status, fmi2String category, fmi2String message, ...);
typedef void *(*fmi2CallbackAllocateMemory)(size_t count, size_t size);
typedef void (*fmi2CallbackFreeMemory)(void *);
typedef void (*fmi2StepFinished)(fmi2ComponentEnvironment, fmi2Status);

typedef struct {
    fmi2CallbackLogger logger;
    fmi2CallbackAllocateMemory allocateMemory;
    fmi2CallbackFreeMemory freeMemory;
    fmi2StepFinished stepFinished;
    fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;

typedef struct {
    fmi2Boolean newDiscreteStatesNeeded;
    fmi2Boolean terminateSimulation;
    fmi2Boolean nominalsOfContinuousStatesChanged;
    fmi2Boolean valuesOfContinuousStatesChanged;
    fmi2Boolean nextEventTimeDefined;
    fmi2Real nextEventTime;
} fmi2EventInfo;

typedef const char *fmi2GetTypesPlatformTYPE(void);
typedef const char *fmi2GetVersionTYPE(void);
typedef fmi2Status fmi2SetDebugLoggingTYPE(fmi2Component, fmi2Boolean on, size_t, const fmi2String categories[]);
typedef fmi2Component fmi2InstantiateTYPE(fmi2String name, fmi2Type, fmi2String guid, fmi2String resources,
    const fmi2CallbackFunctions *, fmi2Boolean visible, fmi2Boolean logging);
typedef void fmi2FreeInstanceTYPE(fmi2Component);
typedef fmi2Status fmi2SetupExperimentTYPE(fmi2Component, fmi2Boolean has_tolerance, fmi2Real tolerance,
    fmi2Real start, fmi2Boolean has_stop, fmi2Real stop);

/* Functions that change the mode and nothing else. */
#define FMI2_MODE_TYPE(name) typedef fmi2Status name##TYPE(fmi2Component);
FMI2_MODE_TYPE(fmi2EnterInitializationMode)
FMI2_MODE_TYPE(fmi2ExitInitializationMode)
FMI2_MODE_TYPE(fmi2Terminate)
FMI2_MODE_TYPE(fmi2Reset)
FMI2_MODE_TYPE(fmi2EnterEventMode)
FMI2_MODE_TYPE(fmi2EnterContinuousTimeMode)
FMI2_MODE_TYPE(fmi2CancelStep)
#undef FMI2_MODE_TYPE

#define FMI2_VALUE_TYPES(type) \
    typedef fmi2Status fmi2Get##type##TYPE(fmi2Component, const fmi2ValueReference[], size_t, fmi2##type[]); \
    typedef fmi2Status fmi2Set##type##TYPE(fmi2Component, const fmi2ValueReference[], size_t, const fmi2##type[]); \
    typedef fmi2Status fmi2Get##type##StatusTYPE(fmi2Component, const fmi2StatusKind, fmi2##type *);
FMI2_VALUE_TYPES(Real)
FMI2_VALUE_TYPES(Integer)
FMI2_VALUE_TYPES(Boolean)
FMI2_VALUE_TYPES(String)
#undef FMI2_VALUE_TYPES
typedef fmi2Status fmi2GetStatusTYPE(fmi2Component, const fmi2StatusKind, fmi2Status *);

typedef fmi2Status fmi2GetFMUstateTYPE(fmi2Component, fmi2FMUstate *);
typedef fmi2Status fmi2SetFMUstateTYPE(fmi2Component, fmi2FMUstate);
typedef fmi2Status fmi2FreeFMUstateTYPE(fmi2Component, fmi2FMUstate *);
typedef fmi2Status fmi2SerializedFMUstateSizeTYPE(fmi2Component, fmi2FMUstate, size_t *);
typedef fmi2Status fmi2SerializeFMUstateTYPE(fmi2Component, fmi2FMUstate, fmi2Byte[], size_t);
typedef fmi2Status fmi2DeSerializeFMUstateTYPE(fmi2Component, const fmi2Byte[], size_t, fmi2FMUstate *);

typedef fmi2Status fmi2GetDirectionalDerivativeTYPE(fmi2Component, const fmi2ValueReference unknowns[], size_t,
    const fmi2ValueReference knowns[], size_t, const fmi2Real seed[], fmi2Real sensitivity[]);
typedef fmi2Status fmi2NewDiscreteStatesTYPE(fmi2Component, fmi2EventInfo *);
typedef fmi2Status fmi2CompletedIntegratorStepTYPE(
    fmi2Component, fmi2Boolean no_going_back, fmi2Boolean *event_mode, fmi2Boolean *terminate);
typedef fmi2Status fmi2SetTimeTYPE(fmi2Component, fmi2Real);
typedef fmi2Status fmi2SetContinuousStatesTYPE(fmi2Component, const fmi2Real[], size_t);
typedef fmi2Status fmi2GetDerivativesTYPE(fmi2Component, fmi2Real[], size_t);
typedef fmi2Status fmi2GetEventIndicatorsTYPE(fmi2Component, fmi2Real[], size_t);
typedef fmi2Status fmi2GetContinuousStatesTYPE(fmi2Component, fmi2Real[], size_t);
typedef fmi2Status fmi2GetNominalsOfContinuousStatesTYPE(fmi2Component, fmi2Real[], size_t);
typedef fmi2Status fmi2SetRealInputDerivativesTYPE(
    fmi2Component, const fmi2ValueReference[], size_t, const fmi2Integer orders[], const fmi2Real[]);
typedef fmi2Status fmi2GetRealOutputDerivativesTYPE(
    fmi2Component, const fmi2ValueReference[], size_t, const fmi2Integer orders[], fmi2Real[]);
typedef fmi2Status fmi2DoStepTYPE(fmi2Component, fmi2Real time, fmi2Real step, fmi2Boolean no_going_back);

#ifdef __cplusplus
}
#endif

#endif
