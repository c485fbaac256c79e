<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis simplifyAlgorithm="0" maxScale="0" simplifyDrawingTol="1" symbologyReferenceScale="-1" readOnly="0" simplifyMaxScale="1" version="3.22.16-Białowieża" simplifyDrawingHints="1" hasScaleBasedVisibilityFlag="0" styleCategories="LayerConfiguration|Symbology|Labeling|Fields|Forms|MapTips|AttributeTable|Rendering" minScale="100000000" labelsEnabled="0" simplifyLocal="1">
  <flags>
    <Identifiable>1</Identifiable>
    <Removable>1</Removable>
    <Searchable>1</Searchable>
    <Private>0</Private>
  </flags>
  <renderer-v2 attr="status" symbollevels="0" forceraster="0" referencescale="-1" type="categorizedSymbol" enableorderby="0">
    <categories>
      <category label="placed" render="true" value="auto" symbol="0"/>
      <category label="confirmed by hand" render="true" value="ok" symbol="1"/>
      <category label="needs a hand check" render="true" value="check" symbol="2"/>
    </categories>
    <symbols>
      <symbol clip_to_extent="1" name="0" alpha="1" type="fill" force_rhr="0">
        <data_defined_properties>
          <Option type="Map">
            <Option value="" name="name" type="QString"/>
            <Option name="properties"/>
            <Option value="collection" name="type" type="QString"/>
          </Option>
        </data_defined_properties>
        <layer locked="0" enabled="1" pass="0" class="SimpleFill">
          <Option type="Map">
            <Option value="3x:0,0,0,0,0,0" name="border_width_map_unit_scale" type="QString"/>
            <Option value="0,0,255,255" name="color" type="QString"/>
            <Option value="bevel" name="joinstyle" type="QString"/>
            <Option value="0,0" name="offset" type="QString"/>
            <Option value="3x:0,0,0,0,0,0" name="offset_map_unit_scale" type="QString"/>
            <Option value="MM" name="offset_unit" type="QString"/>
            <Option value="85,85,85,255" name="outline_color" type="QString"/>
            <Option value="solid" name="outline_style" type="QString"/>
            <Option value="0.4" name="outline_width" type="QString"/>
            <Option value="MM" name="outline_width_unit" type="QString"/>
            <Option value="no" name="style" type="QString"/>
          </Option>
          <prop v="3x:0,0,0,0,0,0" k="border_width_map_unit_scale"/>
          <prop v="0,0,255,255" k="color"/>
          <prop v="bevel" k="joinstyle"/>
          <prop v="0,0" k="offset"/>
          <prop v="3x:0,0,0,0,0,0" k="offset_map_unit_scale"/>
          <prop v="MM" k="offset_unit"/>
          <prop v="85,85,85,255" k="outline_color"/>
          <prop v="solid" k="outline_style"/>
          <prop v="0.4" k="outline_width"/>
          <prop v="MM" k="outline_width_unit"/>
          <prop v="no" k="style"/>
          <data_defined_properties>
            <Option type="Map">
              <Option value="" name="name" type="QString"/>
              <Option name="properties"/>
              <Option value="collection" name="type" type="QString"/>
            </Option>
          </data_defined_properties>
        </layer>
      </symbol>
      <symbol clip_to_extent="1" name="1" alpha="1" type="fill" force_rhr="0">
        <data_defined_properties>
          <Option type="Map">
            <Option value="" name="name" type="QString"/>
            <Option name="properties"/>
            <Option value="collection" name="type" type="QString"/>
          </Option>
        </data_defined_properties>
        <layer locked="0" enabled="1" pass="0" class="SimpleFill">
          <Option type="Map">
            <Option value="3x:0,0,0,0,0,0" name="border_width_map_unit_scale" type="QString"/>
            <Option value="0,0,255,255" name="color" type="QString"/>
            <Option value="bevel" name="joinstyle" type="QString"/>
            <Option value="0,0" name="offset" type="QString"/>
            <Option value="3x:0,0,0,0,0,0" name="offset_map_unit_scale" type="QString"/>
            <Option value="MM" name="offset_unit" type="QString"/>
            <Option value="46,139,61,255" name="outline_color" type="QString"/>
            <Option value="solid" name="outline_style" type="QString"/>
            <Option value="0.6" name="outline_width" type="QString"/>
            <Option value="MM" name="outline_width_unit" type="QString"/>
            <Option value="no" name="style" type="QString"/>
          </Option>
          <prop v="3x:0,0,0,0,0,0" k="border_width_map_unit_scale"/>
          <prop v="0,0,255,255" k="color"/>
          <prop v="bevel" k="joinstyle"/>
          <prop v="0,0" k="offset"/>
          <prop v="3x:0,0,0,0,0,0" k="offset_map_unit_scale"/>
          <prop v="MM" k="offset_unit"/>
          <prop v="46,139,61,255" k="outline_color"/>
          <prop v="solid" k="outline_style"/>
          <prop v="0.6" k="outline_width"/>
          <prop v="MM" k="outline_width_unit"/>
          <prop v="no" k="style"/>
          <data_defined_properties>
            <Option type="Map">
              <Option value="" name="name" type="QString"/>
              <Option name="properties"/>
              <Option value="collection" name="type" type="QString"/>
            </Option>
          </data_defined_properties>
        </layer>
      </symbol>
      <symbol clip_to_extent="1" name="2" alpha="1" type="fill" force_rhr="0">
        <data_defined_properties>
          <Option type="Map">
            <Option value="" name="name" type="QString"/>
            <Option name="properties"/>
            <Option value="collection" name="type" type="QString"/>
          </Option>
        </data_defined_properties>
        <layer locked="0" enabled="1" pass="0" class="SimpleFill">
          <Option type="Map">
            <Option value="3x:0,0,0,0,0,0" name="border_width_map_unit_scale" type="QString"/>
            <Option value="0,0,255,255" name="color" type="QString"/>
            <Option value="bevel" name="joinstyle" type="QString"/>
            <Option value="0,0" name="offset" type="QString"/>
            <Option value="3x:0,0,0,0,0,0" name="offset_map_unit_scale" type="QString"/>
            <Option value="MM" name="offset_unit" type="QString"/>
            <Option value="106,61,154,255" name="outline_color" type="QString"/>
            <Option value="solid" name="outline_style" type="QString"/>
            <Option value="0.9" name="outline_width" type="QString"/>
            <Option value="MM" name="outline_width_unit" type="QString"/>
            <Option value="no" name="style" type="QString"/>
          </Option>
          <prop v="3x:0,0,0,0,0,0" k="border_width_map_unit_scale"/>
          <prop v="0,0,255,255" k="color"/>
          <prop v="bevel" k="joinstyle"/>
          <prop v="0,0" k="offset"/>
          <prop v="3x:0,0,0,0,0,0" k="offset_map_unit_scale"/>
          <prop v="MM" k="offset_unit"/>
          <prop v="106,61,154,255" k="outline_color"/>
          <prop v="solid" k="outline_style"/>
          <prop v="0.9" k="outline_width"/>
          <prop v="MM" k="outline_width_unit"/>
          <prop v="no" k="style"/>
          <data_defined_properties>
            <Option type="Map">
              <Option value="" name="name" type="QString"/>
              <Option name="properties"/>
              <Option value="collection" name="type" type="QString"/>
            </Option>
          </data_defined_properties>
        </layer>
      </symbol>
    </symbols>
    <rotation/>
    <sizescale/>
  </renderer-v2>
  <blendMode>0</blendMode>
  <featureBlendMode>0</featureBlendMode>
  <layerOpacity>1</layerOpacity>
  <fieldConfiguration>
    <field configurationFlags="None" name="plot_id">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="status">
      <editWidget type="ValueMap">
        <config>
          <Option type="Map">
            <Option name="map" type="List">
              <Option type="Map">
                <Option value="auto" name="placed" type="QString"/>
              </Option>
              <Option type="Map">
                <Option value="ok" name="confirmed by hand" type="QString"/>
              </Option>
              <Option type="Map">
                <Option value="check" name="needs a hand check" type="QString"/>
              </Option>
            </Option>
          </Option>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="reason">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="offset_e_m">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="offset_n_m">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="rot_deg">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="ratio">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="margin">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="residual_m">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="share">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="n_field">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="n_measured">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="n_pairs">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="n_sugg">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="radius_m">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="x">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field configurationFlags="None" name="y">
      <editWidget type="">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
  </fieldConfiguration>
  <aliases>
    <alias index="0" name="Plot" field="plot_id"/>
    <alias index="1" name="Status" field="status"/>
    <alias index="2" name="Reason" field="reason"/>
    <alias index="3" name="Moved east [m]" field="offset_e_m"/>
    <alias index="4" name="Moved north [m]" field="offset_n_m"/>
    <alias index="5" name="Turned clockwise [°]" field="rot_deg"/>
    <alias index="6" name="Score over the next best placing" field="ratio"/>
    <alias index="7" name="Log-likelihood over the next best placing" field="margin"/>
    <alias index="8" name="Residual of the pairs [m]" field="residual_m"/>
    <alias index="9" name="Share of trees with a partner within 1 m" field="share"/>
    <alias index="10" name="Field trees" field="n_field"/>
    <alias index="11" name="Measured trees in the circle" field="n_measured"/>
    <alias index="12" name="Pairs" field="n_pairs"/>
    <alias index="13" name="Suggestions" field="n_sugg"/>
    <alias index="14" name="Radius [m]" field="radius_m"/>
    <alias index="15" name="Easting of the centre, co-registered [m]" field="x"/>
    <alias index="16" name="Northing of the centre, co-registered [m]" field="y"/>
  </aliases>
  <defaults>
    <default expression="" applyOnUpdate="0" field="plot_id"/>
    <default expression="" applyOnUpdate="0" field="status"/>
    <default expression="" applyOnUpdate="0" field="reason"/>
    <default expression="" applyOnUpdate="0" field="offset_e_m"/>
    <default expression="" applyOnUpdate="0" field="offset_n_m"/>
    <default expression="" applyOnUpdate="0" field="rot_deg"/>
    <default expression="" applyOnUpdate="0" field="ratio"/>
    <default expression="" applyOnUpdate="0" field="margin"/>
    <default expression="" applyOnUpdate="0" field="residual_m"/>
    <default expression="" applyOnUpdate="0" field="share"/>
    <default expression="" applyOnUpdate="0" field="n_field"/>
    <default expression="" applyOnUpdate="0" field="n_measured"/>
    <default expression="" applyOnUpdate="0" field="n_pairs"/>
    <default expression="" applyOnUpdate="0" field="n_sugg"/>
    <default expression="" applyOnUpdate="0" field="radius_m"/>
    <default expression="" applyOnUpdate="0" field="x"/>
    <default expression="" applyOnUpdate="0" field="y"/>
  </defaults>
  <constraints>
    <constraint notnull_strength="0" constraints="0" unique_strength="0" exp_strength="0" field="plot_id"/>
    <constraint notnull_strength="0" constraints="0" unique_strength="0" exp_strength="0" field="status"/>
    <constraint notnull_strength="0" constraints="0" unique_strength="0" exp_strength="0" field="reason"/>
    <constraint notnull_strength="0" constraints="0" unique_strength="0" exp_strength="0" field="offset_e_m"/>
    <constraint notnull_strength="0" constraints="0" unique_strength="0" exp_strength="0" field="offset_n_m"/>
    <constraint notnull_strength="0" constraints="0" unique_strength="0" exp_strength="0" field="rot_deg"/>
    <constraint notnull_strength="0" constraints="0" unique_strength="0" exp_strength="0" field="ratio"/>
    <constraint notnull_strength="0" constraints="0" unique_strength="0" exp_strength="0" field="margin"/>
    <constraint notnull_strength="0" constraints="0" unique_strength="0" exp_strength="0" field="residual_m"/>
    <constraint notnull_strength="0" constraints="0" unique_strength="0" exp_strength="0" field="share"/>
    <constraint notnull_strength="0" constraints="0" unique_strength="0" exp_strength="0" field="n_field"/>
    <constraint notnull_strength="0" constraints="0" unique_strength="0" exp_strength="0" field="n_measured"/>
    <constraint notnull_strength="0" constraints="0" unique_strength="0" exp_strength="0" field="n_pairs"/>
    <constraint notnull_strength="0" constraints="0" unique_strength="0" exp_strength="0" field="n_sugg"/>
    <constraint notnull_strength="0" constraints="0" unique_strength="0" exp_strength="0" field="radius_m"/>
    <constraint notnull_strength="0" constraints="0" unique_strength="0" exp_strength="0" field="x"/>
    <constraint notnull_strength="0" constraints="0" unique_strength="0" exp_strength="0" field="y"/>
  </constraints>
  <constraintExpressions>
    <constraint exp="" desc="" field="plot_id"/>
    <constraint exp="" desc="" field="status"/>
    <constraint exp="" desc="" field="reason"/>
    <constraint exp="" desc="" field="offset_e_m"/>
    <constraint exp="" desc="" field="offset_n_m"/>
    <constraint exp="" desc="" field="rot_deg"/>
    <constraint exp="" desc="" field="ratio"/>
    <constraint exp="" desc="" field="margin"/>
    <constraint exp="" desc="" field="residual_m"/>
    <constraint exp="" desc="" field="share"/>
    <constraint exp="" desc="" field="n_field"/>
    <constraint exp="" desc="" field="n_measured"/>
    <constraint exp="" desc="" field="n_pairs"/>
    <constraint exp="" desc="" field="n_sugg"/>
    <constraint exp="" desc="" field="radius_m"/>
    <constraint exp="" desc="" field="x"/>
    <constraint exp="" desc="" field="y"/>
  </constraintExpressions>
  <expressionfields/>
  <attributetableconfig actionWidgetStyle="dropDown" sortOrder="0" sortExpression="">
    <columns/>
  </attributetableconfig>
  <conditionalstyles>
    <rowstyles/>
    <fieldstyles/>
  </conditionalstyles>
  <storedexpressions/>
  <editform tolerant="1"></editform>
  <editforminit/>
  <editforminitcodesource>0</editforminitcodesource>
  <editforminitfilepath></editforminitfilepath>
  <editforminitcode><![CDATA[]]></editforminitcode>
  <featformsuppress>0</featformsuppress>
  <editorlayout>generatedlayout</editorlayout>
  <editable/>
  <labelOnTop/>
  <reuseLastValue/>
  <dataDefinedFieldProperties/>
  <widgets/>
  <previewExpression>"plot_id"</previewExpression>
  <mapTip>&lt;b>Plot [% "plot_id" %]&lt;/b> ([% "status" %])&lt;br>[% "n_pairs" %] of [% "n_field" %] field trees paired&lt;br>moved [% format_number("offset_e_m", 2) %] m east, [% format_number("offset_n_m", 2) %] m north, turned [% format_number("rot_deg", 1) %]°[% coalesce('&lt;br>' || "reason", '') %]</mapTip>
  <layerGeometryType>2</layerGeometryType>
</qgis>
