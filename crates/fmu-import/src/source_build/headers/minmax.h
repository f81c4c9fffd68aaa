/* Defines the macros of a header of Windows, for sources that include it everywhere. */
#ifndef trackside_minmax_h
#define trackside_minmax_h

#ifndef max
#define max(a, b) ((a) > (b) ? (a) : (b))
#endif
#ifndef min
#define min(a, b) ((a) < (b) ? (a) : (b))
#endif

#endif
