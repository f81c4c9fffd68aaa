# The released program, for `docker run --rm --volume "$PWD:/work" trackside`, which tests /work/scenarios, or `... trackside test /work`, which tests
# the files of /work itself. The wheel is one of `dist`, made by `python/build.py`.
FROM python:3.12-slim
COPY dist/trackside-*.whl /tmp/
RUN pip install --no-cache-dir --no-compile /tmp/trackside-*.whl && rm /tmp/trackside-*.whl \
    && useradd --create-home --uid 1000 trackside
USER trackside
# Results go to target/runs below this folder.
WORKDIR /work
ENTRYPOINT ["trackside"]
CMD ["test"]
