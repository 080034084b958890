/* Heat rod of benches/stiff.rs with CVODE (BDF, banded and dense Newton), for comparison. Requires SUNDIALS 6:
   cc -O3 cvode_rod.c -o cvode_rod -lsundials_cvode -lsundials_nvecserial -lsundials_sunmatrixband \
      -lsundials_sunmatrixdense -lsundials_sunlinsolband -lsundials_sunlinsoldense -lm && ./cvode_rod */

#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <stdio.h>
#include <sunlinsol/sunlinsol_band.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_band.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <time.h>

#define N 100

/* Temperatures, K: left end fixed at 400 K, right end insulated, radiation to 300 K. */
static int derivative(realtype t, N_Vector x, N_Vector dx, void *data) {
    (void)t, (void)data;
    const double *T = NV_DATA_S(x);
    double *d = NV_DATA_S(dx);
    for (int i = 0; i < N; i++) {
        const double left = i > 0 ? T[i - 1] : 400.0, right = i < N - 1 ? T[i + 1] : T[i];
        const double s = T[i] * T[i];
        d[i] = 1000.0 * (left - 2 * T[i] + right) - 1e-10 * (s * s - 8.1e9);
    }
    return 0;
}

static double simulate(int banded, double *end, long *steps, long *evaluations) {
    SUNContext context;
    struct timespec start, done;
    realtype t;
    clock_gettime(CLOCK_MONOTONIC, &start);
    SUNContext_Create(NULL, &context);
    N_Vector x = N_VNew_Serial(N, context);
    N_VConst(300.0, x);
    void *cvode = CVodeCreate(CV_BDF, context);
    CVodeInit(cvode, derivative, 0, x);
    CVodeSStolerances(cvode, 1e-6, 1e-6);
    SUNMatrix matrix = banded ? SUNBandMatrix(N, 1, 1, context) : SUNDenseMatrix(N, N, context);
    SUNLinearSolver solver = banded ? SUNLinSol_Band(x, matrix, context) : SUNLinSol_Dense(x, matrix, context);
    CVodeSetLinearSolver(cvode, solver, matrix);
    CVodeSetMaxNumSteps(cvode, 100000);
    CVodeSetStopTime(cvode, 10);
    CVode(cvode, 10, x, &t, CV_NORMAL);
    CVodeGetNumSteps(cvode, steps);
    CVodeGetNumRhsEvals(cvode, evaluations);
    end[0] = NV_Ith_S(x, 0), end[1] = NV_Ith_S(x, N / 2), end[2] = NV_Ith_S(x, N - 1);
    CVodeFree(&cvode);
    SUNLinSolFree(solver);
    SUNMatDestroy(matrix);
    N_VDestroy(x);
    SUNContext_Free(&context);
    clock_gettime(CLOCK_MONOTONIC, &done);
    return 1e6 * (done.tv_sec - start.tv_sec) + 1e-3 * (done.tv_nsec - start.tv_nsec);
}

int main(void) {
    for (int banded = 1; banded >= 0; banded--) {
        double end[3], best = 1e9;
        long steps, evaluations;
        for (int i = 0; i < 100; i++) {
            const double us = simulate(banded, end, &steps, &evaluations);
            if (us < best) best = us;
        }
        printf("CVODE BDF %s %.1f us, %ld steps, %ld right-hand sides, end %.9f, %.9f, %.9f\n",
               banded ? "banded" : "dense", best, steps, evaluations, end[0], end[1], end[2]);
    }
    return 0;
}
